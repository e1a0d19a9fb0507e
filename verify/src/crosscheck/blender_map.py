# Camera rays are the light rays: an orthographic camera behind the block looks through it at a receiver whose emission
# says where on it a ray has landed: red = x, green = y from LANDED_FROM to LANDED_TO, blue = 1 everywhere on it.
glass = block()
clear, bsdf = material("glass", "ShaderNodeBsdfRefraction", Color=(1, 1, 1, 1), Roughness=0, IOR=INDEX)
# Normals as an attribute, which is interpolated in single precision: Blender keeps a mesh's own normals in 16 bits.
nodes, links = clear.node_tree.nodes, clear.node_tree.links
normal, towards = nodes.new("ShaderNodeAttribute"), nodes.new("ShaderNodeVectorMath")
normal.attribute_name = "smooth_normal"
towards.operation = "SCALE"  # by 1 where a ray enters, by -1 where it leaves
sign = nodes.new("ShaderNodeMath")
sign.operation = "MULTIPLY_ADD"
sign.inputs[1].default_value, sign.inputs[2].default_value = -2, 1
links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], sign.inputs[0])
links.new(normal.outputs["Vector"], towards.inputs[0])
links.new(sign.outputs["Value"], towards.inputs["Scale"])
links.new(towards.outputs["Vector"], bsdf.inputs["Normal"])
glass.data.materials.append(clear)

receiver = rectangle("receiver", *LANDED_FROM, *LANDED_TO, DISTANCE)
emitter, emission = material("position", "ShaderNodeEmission", output="Emission", Strength=1)
nodes, links = emitter.node_tree.nodes, emitter.node_tree.links
place = nodes.new("ShaderNodeNewGeometry").outputs["Position"]
shift, scale = nodes.new("ShaderNodeVectorMath"), nodes.new("ShaderNodeVectorMath")
shift.operation, scale.operation = "SUBTRACT", "MULTIPLY"
shift.inputs[1].default_value = (UNIT * LANDED_FROM[0], UNIT * LANDED_FROM[1], 0)
span = [UNIT * (b - a) for a, b in zip(LANDED_FROM, LANDED_TO)]
scale.inputs[1].default_value = (1 / span[0], 1 / span[1], 1 / (UNIT * DISTANCE))
links.new(place, shift.inputs[0])
links.new(shift.outputs["Vector"], scale.inputs[0])
links.new(scale.outputs["Vector"], emission.inputs["Color"])
if hasattr(emitter.cycles, "sample_as_light"):
    emitter.cycles.sample_as_light = False
receiver.data.materials.append(emitter)

camera(*BLOCK_FROM, *BLOCK_TO, ENTRY_Z - 10)
render("map.exr", samples=1, filter_width=0.01, seed=0)
