// Camera rays are the light rays: in parallel light an orthographic camera looks along it, else the camera stands at the source.
// It looks through the block, or into the mirror, at a receiver whose colour says where on it a ray has landed, in the receiver's
// own coordinates: red = x, green = y from Landed_From to Landed_To, blue = 1 everywhere on it.
#version 3.7;
global_settings { assumed_gamma 1.0 ambient_light 0 max_trace_level 12 adc_bailout 0 }

camera {
#if (At_Source) perspective #else orthographic #end
  location View_Location
  direction View_Direction
  right View_Right
  up View_Up
}

#include "block.inc"
object {
  Block
#if (Mirror)
  pigment { rgb 0 }
  finish { ambient 0 diffuse 0 specular 0 reflection { 1 } }
#else
  pigment { rgbt <1, 1, 1, 1> }
  finish { ambient 0 diffuse 0 specular 0 }
  interior { ior Index }
#end
}

polygon {
  5,
  <Landed_From.x, Landed_From.y>, <Landed_To.x, Landed_From.y>, <Landed_To.x, Landed_To.y>,
  <Landed_From.x, Landed_To.y>, <Landed_From.x, Landed_From.y>
  // The mean of three colours, each three times too bright.
  pigment {
    average
    pigment_map {
      [1 gradient x color_map { [0 rgb 0] [1 rgb <3, 0, 0>] }
        scale <Landed_To.x - Landed_From.x, 1, 1> translate <Landed_From.x, 0, 0>]
      [1 gradient y color_map { [0 rgb 0] [1 rgb <0, 3, 0>] }
        scale <1, Landed_To.y - Landed_From.y, 1> translate <0, Landed_From.y, 0>]
      [1 rgb <0, 0, 3>]
    }
  }
  finish { ambient 0 diffuse 0 emission 1 }
  matrix <
    Receiver_X.x, Receiver_X.y, Receiver_X.z,
    Receiver_Y.x, Receiver_Y.y, Receiver_Y.z,
    Receiver_Z.x, Receiver_Z.y, Receiver_Z.z,
    0, 0, Distance
  >
#if (Mirror) no_image #end // It may stand between camera and mirror.
}
