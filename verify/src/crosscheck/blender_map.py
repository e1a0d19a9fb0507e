# Camera rays are the light rays: in parallel light an orthographic camera looks along it, else the camera stands at the source. It
# looks through the block, or into the mirror, at a receiver whose emission says where on it a ray has landed, in the receiver's own
# coordinates: red = x, green = y from LANDED_FROM to LANDED_TO, blue = 1 everywhere on it.
glass = block()
if MIRROR:
    clear, bsdf = material("mirror", "ShaderNodeBsdfGlossy", Color=(1, 1, 1, 1), Roughness=0)
else:
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
# A ray that has just left the glass may meet the same face again by rounding, and would be refracted twice: after less
# than a hundredth of a millimetre it passes.
far, mix = nodes.new("ShaderNodeMath"), nodes.new("ShaderNodeMixShader")
far.operation = "GREATER_THAN"
far.inputs[1].default_value = 0.01 * UNIT
links.new(nodes.new("ShaderNodeLightPath").outputs["Ray Length"], far.inputs[0])
links.new(far.outputs["Value"], mix.inputs["Fac"])
links.new(nodes.new("ShaderNodeBsdfTransparent").outputs["BSDF"], mix.inputs[1])
links.new(bsdf.outputs["BSDF"], mix.inputs[2])
links.new(mix.outputs["Shader"], clear.node_tree.get_output_node("CYCLES").inputs["Surface"])
glass.data.materials.append(clear)

receiver = rectangle("receiver", *LANDED_FROM, *LANDED_TO, 0)
receiver.matrix_world = placed(RECEIVER_X, RECEIVER_Y, RECEIVER_Z, (0, 0, DISTANCE))
if MIRROR:  # It may stand between camera and mirror.
    receiver.visible_camera = False
emitter, emission = material("position", "ShaderNodeEmission", output="Emission", Strength=1)
nodes, links = emitter.node_tree.nodes, emitter.node_tree.links
place = nodes.new("ShaderNodeTexCoord").outputs["Object"]
shift, scale = nodes.new("ShaderNodeVectorMath"), nodes.new("ShaderNodeVectorMath")
shift.operation, scale.operation = "SUBTRACT", "MULTIPLY"
shift.inputs[1].default_value = (UNIT * LANDED_FROM[0], UNIT * LANDED_FROM[1], 0)
span = [UNIT * (b - a) for a, b in zip(LANDED_FROM, LANDED_TO)]
scale.inputs[1].default_value = (1 / span[0], 1 / span[1], 0)
everywhere = nodes.new("ShaderNodeVectorMath")
everywhere.operation = "ADD"
everywhere.inputs[1].default_value = (0, 0, 1)
links.new(place, shift.inputs[0])
links.new(shift.outputs["Vector"], scale.inputs[0])
links.new(scale.outputs["Vector"], everywhere.inputs[0])
links.new(everywhere.outputs["Vector"], emission.inputs["Color"])
if hasattr(emitter.cycles, "sample_as_light"):
    emitter.cycles.sample_as_light = False
receiver.data.materials.append(emitter)

view()
render("map.exr", samples=1, filter_width=0.01, seed=0, reflects=MIRROR)
