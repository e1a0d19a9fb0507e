import array
import math
import os
import sys

import bpy
import mathutils

FOLDER = os.path.dirname(os.path.abspath(__file__))
UNIT = 0.01  # Blender units per millimetre: numbers near 1 keep single precision accurate.


def numbers(name, kind):
    """A file of little-endian numbers as an array."""
    values = array.array(kind)
    path = os.path.join(FOLDER, name)
    with open(path, "rb") as file:
        values.fromfile(file, os.path.getsize(path) // values.itemsize)
    if sys.byteorder == "big":
        values.byteswap()
    return values


def add(name, data):
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    return made


def material(name, shader, output="BSDF", **inputs):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    node = nodes.new(shader)
    if hasattr(node, "distribution"):
        kinds = node.bl_rna.properties["distribution"].enum_items.keys()
        node.distribution = "SHARP" if "SHARP" in kinds else "GGX"
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    links.new(node.outputs[output], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made, node


def block():
    """The block with its normals; corners of flat faces have vertices of their own."""
    positions, normals, triangles = numbers("positions.f32", "f"), numbers("normals.f32", "f"), numbers("triangles.u32", "I")
    count = len(triangles) // 3
    mesh = bpy.data.meshes.new("block")
    mesh.vertices.add(len(positions) // 3)
    mesh.vertices.foreach_set("co", array.array("f", (UNIT * p for p in positions)))
    mesh.loops.add(len(triangles))
    mesh.loops.foreach_set("vertex_index", array.array("i", triangles))
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", array.array("i", range(0, 3 * count, 3)))
    if bpy.app.version < (4, 0, 0):
        mesh.polygons.foreach_set("loop_total", array.array("i", [3]) * count)
    mesh.polygons.foreach_set("use_smooth", array.array("b", [1]) * count)
    mesh.attributes.new("smooth_normal", "FLOAT_VECTOR", "POINT").data.foreach_set("vector", normals)
    mesh.update(calc_edges=True)
    if hasattr(mesh, "use_auto_smooth"):
        mesh.use_auto_smooth = True
    each = iter(normals)
    mesh.normals_split_custom_set_from_vertices(list(zip(each, each, each)))
    return add("block", mesh)


def rectangle(name, x0, y0, x1, y1, z):
    mesh = bpy.data.meshes.new(name)
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    mesh.from_pydata([(UNIT * x, UNIT * y, UNIT * z) for x, y in corners], [], [(0, 1, 2, 3)])
    return add(name, mesh)


def placed(x, y, z, at):
    """The matrix of an object whose axes are these unit vectors, at this place (mm)."""
    return mathutils.Matrix([(a, b, c, UNIT * d) for a, b, c, d in zip(x, y, z, at)] + [(0, 0, 0, 1)])


def camera(x0, y0, x1, y1, z):
    """An orthographic camera that looks along +z at this rectangle; the picture's left is +x."""
    at = ((x0 + x1) / 2, (y0 + y1) / 2, z)
    looking("ORTHO", x1 - x0, y1 - y0, placed((-1, 0, 0), (0, 1, 0), (0, 0, -1), at))


def view():
    """The camera whose rays are the rays of the light."""
    vector = mathutils.Vector
    right, up, looks = vector(VIEW_RIGHT), vector(VIEW_UP), vector(VIEW_LOOKS)
    width, height = right.length, up.length
    matrix = placed(right / width, up / height, -looks, VIEW_LOCATION)
    if not AT_SOURCE:
        looking("ORTHO", width, height, matrix)
        return
    towards = vector(VIEW_CENTRE) - vector(VIEW_LOCATION)
    data = looking("PERSP", width, height, matrix)
    data.lens = data.sensor_width * towards.dot(looks) / width
    data.shift_x, data.shift_y = towards.dot(right) / width**2, towards.dot(up) / height / width


def looking(kind, width, height, matrix):
    data = bpy.data.cameras.new("camera")
    data.type = kind
    data.sensor_fit = "HORIZONTAL"
    if kind == "ORTHO":
        data.ortho_scale = UNIT * width
    data.clip_start, data.clip_end = 1e-3, 1e5
    made = add("camera", data)
    made.matrix_world = matrix
    scene = bpy.context.scene
    scene.camera = made
    render = scene.render
    render.resolution_x, render.resolution_y = PIXELS
    render.resolution_percentage = 100
    aspect = (height / PIXELS[1]) / (width / PIXELS[0])
    render.pixel_aspect_x, render.pixel_aspect_y = (1, aspect) if aspect >= 1 else (1 / aspect, 1)
    return data


def render(name, samples, filter_width, seed, reflects=False):
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.view_settings.view_transform = "Raw"
    world = bpy.data.worlds.new("dark")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    scene.world = world
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = samples
    cycles.seed = seed
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.max_bounces = cycles.transmission_bounces = cycles.transparent_max_bounces = 12
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = 0
    cycles.caustics_refractive = True
    cycles.caustics_reflective = reflects
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = filter_width
    image = scene.render.image_settings
    image.file_format = "OPEN_EXR"
    image.color_mode = "RGB"
    image.color_depth = "32"
    image.exr_codec = "ZIP"
    scene.render.filepath = os.path.join(FOLDER, name)
    bpy.ops.render.render(write_still=True)


bpy.ops.wm.read_factory_settings(use_empty=True)
