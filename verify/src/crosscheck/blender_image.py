# Manifold next-event estimation ("shadow caustics"): light through the block, seen on the receiver by an orthographic
# camera between them.
glass = block()
glass.data.materials.append(material("glass", "ShaderNodeBsdfGlass", Color=(1, 1, 1, 1), Roughness=0, IOR=INDEX)[0])
glass.cycles.is_caustics_caster = True

receiver = rectangle("receiver", -2 * REACH, -2 * REACH, 2 * REACH, 2 * REACH, DISTANCE)
receiver.data.materials.append(material("white", "ShaderNodeBsdfDiffuse", Color=(1, 1, 1, 1))[0])
receiver.cycles.is_caustics_receiver = True

# A black plate with a hole, close to the entry face: however oblique it is, no light passes beside the block, comes by its walls, or
# meets them from inside.
black = material("black", "ShaderNodeBsdfDiffuse", Color=(0, 0, 0, 1))[0]
(x0, y0), (x1, y1) = HOLE_FROM, HOLE_TO
for bar in [(-REACH, -REACH, x0, REACH), (x1, -REACH, REACH, REACH), (x0, -REACH, x1, y0), (x0, y1, x1, REACH)]:
    rectangle("plate", *bar, ENTRY_Z - 0.05).data.materials.append(black)

# A sun would bring no light by this method: a point so far away that its light is parallel. Irradiance is pi at the block.
middle = mathutils.Vector(((x0 + x1) / 2, (y0 + y1) / 2, ENTRY_Z))
place = mathutils.Vector(LIGHT_SOURCE) if AT_SOURCE else middle - 1e6 * mathutils.Vector(LIGHT_DIRECTION)
light = bpy.data.lights.new("light", "POINT")
light.energy = 4 * math.pi**2 * (UNIT * (place - middle).length) ** 2
light.shadow_soft_size = 0
light.cycles.is_caustics_light = True
add("light", light).location = UNIT * place

camera(*WINDOW_FROM, *WINDOW_TO, (TOP_Z + DISTANCE) / 2)
run = int(sys.argv[-1]) if sys.argv[-1].isdigit() else 1
render(f"image-{run}.exr", samples=SAMPLES, filter_width=1, seed=run)
