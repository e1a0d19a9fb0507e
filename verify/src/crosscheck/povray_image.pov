// Photons through the block, seen on the receiver by an orthographic camera between them.
#version 3.7;
#ifndef (Spacing) #declare Spacing = First_Spacing; #end
global_settings {
  assumed_gamma 1.0
  ambient_light 0
  max_trace_level 12
  adc_bailout 0
  photons { spacing Spacing gather 60, 120 autostop 0 jitter 0.4 }
}

camera {
  orthographic
  location <(Window_From.x + Window_To.x) / 2, (Window_From.y + Window_To.y) / 2, (Top_Z + Distance) / 2>
  direction <0, 0, 1>
  right <Window_From.x - Window_To.x, 0, 0> // The picture's left is +x.
  up <0, Window_To.y - Window_From.y, 0>
}

#declare Middle = <(Block_From.x + Block_To.x) / 2, (Block_From.y + Block_To.y) / 2, 0>;
light_source {
#if (At_Source)
  Light_Source
  color rgb Light
#else
  Middle - 10000 * Light_Direction
  color rgb Light
  parallel
  point_at Middle
#end
  photons { refraction on reflection off }
}

#include "block.inc"
object {
  Block
  pigment { rgbt <1, 1, 1, 1> }
  finish { ambient 0 diffuse 0 specular 0 }
  interior { ior Index }
  photons { target refraction on reflection off collect off }
}

// A black plate with a hole, close to the entry face and thin: however oblique it is, no light passes beside the block, comes by its
// walls, or meets them from inside.
#macro Bar(From, To) box { From, To pigment { rgb 0 } finish { ambient 0 diffuse 0 } photons { pass_through off collect off } } #end
#declare Z0 = Entry_Z - 0.02;
#declare Z1 = Entry_Z - 0.01;
Bar(<-Reach, -Reach, Z0>, <Hole_From.x, Reach, Z1>)
Bar(<Hole_To.x, -Reach, Z0>, <Reach, Reach, Z1>)
Bar(<Hole_From.x, -Reach, Z0>, <Hole_To.x, Hole_From.y, Z1>)
Bar(<Hole_From.x, Hole_To.y, Z0>, <Hole_To.x, Reach, Z1>)

plane {
  -z, -Distance
  pigment { rgb 1 }
  finish { ambient 0 diffuse 1 }
}
