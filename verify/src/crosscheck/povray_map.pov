// Camera rays are the light rays: an orthographic camera behind the block looks through it at a receiver whose colour
// says where on it a ray has landed: red = x, green = y from Landed_From to Landed_To, blue = 1 everywhere on it.
#version 3.7;
global_settings { assumed_gamma 1.0 ambient_light 0 max_trace_level 12 adc_bailout 0 }

camera {
  orthographic
  location <(Block_From.x + Block_To.x) / 2, (Block_From.y + Block_To.y) / 2, Entry_Z - 10>
  direction <0, 0, 1>
  right <Block_From.x - Block_To.x, 0, 0> // The picture's left is +x.
  up <0, Block_To.y - Block_From.y, 0>
}

#include "block.inc"
object {
  Block
  pigment { rgbt <1, 1, 1, 1> }
  finish { ambient 0 diffuse 0 specular 0 }
  interior { ior Index }
}

polygon {
  5,
  <Landed_From.x, Landed_From.y>, <Landed_To.x, Landed_From.y>, <Landed_To.x, Landed_To.y>,
  <Landed_From.x, Landed_To.y>, <Landed_From.x, Landed_From.y>
  translate <0, 0, Distance>
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
}
