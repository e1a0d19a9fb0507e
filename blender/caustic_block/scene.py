"""The block and its bench as objects: real size, shadow caustics as they are proved against glasswarp's verifier (docs/crosscheck.md)."""

import math

import bpy
import mathutils
import numpy as np

from . import settings
from .bench import GAP_MM, Bench

#: How wide a block is in Blender's units if Cycles is to find all of its light: below 1 it finds none along borders, beyond 20 there is noise.
WIDE = (1.0, 20.0)
#: What `fit_unit` goes for: its least, and ten times that.
LEAST = 1.5


def unit(thing):
    """Blender's units per millimetre in the scene of an object."""
    scenes = thing.users_scene
    return 0.001 / (settings.exact(scenes[0].unit_settings.scale_length) if scenes else 1.0)


def fits_cycles(thing):
    """Whether Cycles finds all light of a block as large as this one is in Blender's units."""
    least, most = WIDE
    return least <= settings.of(thing).size_mm * unit(thing) * thing.matrix_world.median_scale <= most


def fit_unit(scene, width_mm):
    """Makes a scene's unit a power of ten metres in which a block is neither too small nor too large for Cycles."""
    least, most = WIDE
    if not least <= 0.001 * width_mm / scene.unit_settings.scale_length <= most:
        scene.unit_settings.scale_length = 10.0 ** math.floor(math.log10(0.001 * width_mm / LEAST))


def new_block(context):
    """An empty mesh that will be a block, at the cursor; light goes along +y, so that from the front the picture stands upright."""
    thing = bpy.data.objects.new("Caustic block", bpy.data.meshes.new("Caustic block"))
    context.collection.objects.link(thing)
    turned = mathutils.Matrix(((-1, 0, 0), (0, 0, 1), (0, 1, 0))).to_4x4()
    thing.matrix_world = mathutils.Matrix.Translation(context.scene.cursor.location) @ turned
    settings.begin(thing)
    return thing


def remove(thing):
    """Takes a block and its bench away, as if they had never been."""
    wanted = settings.of(thing)
    parts = [part for part in (wanted.lamp, wanted.receiver, wanted.frame, wanted.camera) if part is not None]
    glass = wanted.glass
    for each in (*parts, thing):
        data = each.data
        bpy.data.objects.remove(each)
        if data.users == 0:
            bpy.data.batch_remove([data])
    if glass is not None and glass.users == 0:
        bpy.data.materials.remove(glass)


def show(thing, solid, bench):
    """Gives a block its mesh, and moves its bench."""
    wanted = settings.of(thing)
    if thing.data.users > 1:
        thing.data = thing.data.copy()
    _fill(thing.data, solid, unit(thing))
    wanted.per_mm = unit(thing)
    wanted.bench = bench.to_text()
    if wanted.glass is None:
        wanted.glass = _material("Caustic glass", "ShaderNodeBsdfGlass", Roughness=0)
        if thing.data.materials:
            thing.data.materials[0] = wanted.glass
        else:
            thing.data.materials.append(wanted.glass)
    for node in wanted.glass.node_tree.nodes if wanted.glass.use_nodes else ():
        if node.type in {"BSDF_GLASS", "BSDF_REFRACTION"}:
            node.inputs["IOR"].default_value = bench.index
    thing.cycles.is_caustics_caster = True
    arrange(thing)


def arrange(thing):
    """Moves what there is of the bench to where it belongs."""
    wanted = settings.of(thing)
    bench = Bench.from_text(wanted.bench)
    mm = unit(thing)
    _rescale(thing, mm)
    for part in (wanted.lamp, wanted.receiver, wanted.frame, wanted.camera):
        if part is not None and part.parent == thing:
            part.matrix_parent_inverse.identity()
    if wanted.receiver is not None:
        (x0, y0), (x1, y1) = bench.window
        size = max(x1 - x0, y1 - y0, bench.upper[0] - bench.lower[0], bench.upper[1] - bench.lower[1])
        middle = ((x0 + x1) / 2, (y0 + y1) / 2)
        low, high = ([c + sign * size for c in middle] for sign in (-1, 1))
        _quads(wanted.receiver.data, [(*low, *high)], 0.0, mm)
        wanted.receiver.matrix_local = mathutils.Matrix.Translation((0, 0, mm * bench.distance))
    if wanted.frame is not None:
        (x0, y0), (x1, y1) = bench.hole
        far = bench.reach
        bars = [(-far, -far, x0, far), (x1, -far, far, far), (x0, -far, x1, y0), (x0, y1, x1, far)]
        _quads(wanted.frame.data, bars, 0.0, mm)
        wanted.frame.matrix_local = mathutils.Matrix.Translation((0, 0, mm * (bench.lower[2] - GAP_MM)))
    if wanted.camera is not None:
        (x0, y0), (x1, y1) = bench.window
        at = ((x0 + x1) / 2, (y0 + y1) / 2, (bench.upper[2] + bench.distance) / 2)
        # It looks along the light; the picture's left is +x.
        looks = mathutils.Matrix.Diagonal((-1, 1, -1, 1))
        wanted.camera.matrix_local = mathutils.Matrix.Translation([mm * c for c in at]) @ looks
        lens = wanted.camera.data
        lens.ortho_scale = mm * max(x1 - x0, y1 - y0)
        lens.clip_start, lens.clip_end = mm * 0.01, mm * 10 * bench.distance
    relight(thing)


def _rescale(thing, mm):
    """Keeps the block's size where the scene has another unit than before."""
    wanted = settings.of(thing)
    factor = mm / wanted.per_mm
    if abs(factor - 1) > 1e-5:
        places = np.empty(3 * len(thing.data.vertices), np.float32)
        thing.data.vertices.foreach_get("co", places)
        thing.data.vertices.foreach_set("co", places * np.float32(factor))
        thing.data.update()
        wanted.per_mm = mm


def relight(thing):
    """Gives the lamp its place, its size and its strength."""
    wanted = settings.of(thing)
    if wanted is None or not wanted.bench or wanted.lamp is None:
        return
    bench = Bench.from_text(wanted.bench)
    mm = unit(thing)
    wanted.lamp.matrix_local = mathutils.Matrix.Translation(mm * mathutils.Vector(bench.lamp))
    lamp = wanted.lamp.data
    away = mm * float(np.linalg.norm(bench.lamp - bench.entry))
    # Irradiance 1 at this distance, seen on white, is 1 / pi.
    lamp.energy = 4 * math.pi**2 * away**2 * bench.irradiance(wanted.brightness)
    lamp.shadow_soft_size = mm * bench.lamp_radius


def add_bench(thing):
    """Adds what is missing of a bench: lamp, receiver, frame, camera."""
    wanted = settings.of(thing)
    if wanted.lamp is None:
        light = bpy.data.lights.new("Caustic light", "POINT")
        light.cycles.is_caustics_light = True
        wanted.lamp = _part(thing, light)
    if wanted.receiver is None:
        wanted.receiver = _part(thing, bpy.data.meshes.new("Caustic receiver"))
        wanted.receiver.data.materials.append(_material("Caustic receiver", "ShaderNodeBsdfDiffuse", Color=(1, 1, 1, 1)))
        wanted.receiver.cycles.is_caustics_receiver = True
    if wanted.frame is None:
        wanted.frame = _part(thing, bpy.data.meshes.new("Caustic frame"))
        wanted.frame.data.materials.append(_material("Caustic frame", "ShaderNodeBsdfDiffuse", Color=(0, 0, 0, 1)))
        wanted.frame.display_type = "WIRE"
    if wanted.camera is None:
        lens = bpy.data.cameras.new("Caustic camera")
        lens.type = "ORTHO"
        wanted.camera = _part(thing, lens)
    if wanted.bench:
        arrange(thing)


def set_up_cycles(scene, thing):
    """Sets a scene to render the caustic of a block as it is, through the camera of its bench."""
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.caustics_refractive = True
    cycles.blur_glossy = 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.max_bounces = max(cycles.max_bounces, 12)
    cycles.transmission_bounces = max(cycles.transmission_bounces, 12)
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    scene.view_settings.view_transform = "Standard"
    wanted = settings.of(thing)
    fit_unit(scene, wanted.size_mm)
    for other in settings.blocks():
        if other.name in scene.objects and settings.of(other).bench:
            arrange(other)
    if wanted.camera is not None:
        scene.camera = wanted.camera
        (x0, y0), (x1, y1) = Bench.from_text(wanted.bench).window
        render = scene.render
        longest = max(render.resolution_x, render.resolution_y)
        render.resolution_x = round(longest * (x1 - x0) / max(x1 - x0, y1 - y0))
        render.resolution_y = round(longest * (y1 - y0) / max(x1 - x0, y1 - y0))
        render.pixel_aspect_x = render.pixel_aspect_y = 1


def _part(thing, data):
    part = bpy.data.objects.new(data.name, data)
    for collection in thing.users_collection:
        collection.objects.link(part)
    part.parent = thing
    return part


def _material(name, shader, **inputs):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    node = nodes.new(shader)
    if hasattr(node, "distribution"):
        # A perfect polish: newer Cycles takes roughness 0 for that.
        kinds = node.bl_rna.properties["distribution"].enum_items.keys()
        node.distribution = "SHARP" if "SHARP" in kinds else "GGX"
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    links.new(node.outputs["BSDF"], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def _quads(mesh, rectangles, z, mm):
    """Level rectangles of least and greatest x and y, mm, as the whole of a mesh."""
    corners = [(x, y, z) for x0, y0, x1, y1 in rectangles for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
    mesh.clear_geometry()
    mesh.from_pydata(
        [[mm * c for c in corner] for corner in corners], [], [range(4 * k, 4 * k + 4) for k in range(len(rectangles))]
    )
    mesh.update()


def _fill(mesh, solid, mm):
    """The triangles of a block, with its normals, as the whole of a mesh."""
    count = len(solid.triangles)
    mesh.clear_geometry()
    mesh.vertices.add(len(solid.vertices))
    mesh.vertices.foreach_set("co", (mm * solid.vertices).astype(np.float32).ravel())
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", solid.triangles.ravel())
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    if bpy.app.version < (4, 0, 0):
        mesh.polygons.foreach_set("loop_total", np.full(count, 3, dtype=np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(count, dtype=bool))
    mesh.update(calc_edges=True)
    if bpy.app.version >= (4, 5, 0):
        # In single precision; what follows keeps 16 bits.
        kept = mesh.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
        kept.data.foreach_set("vector", solid.normals.astype(np.float32).ravel())
        return
    if hasattr(mesh, "use_auto_smooth"):
        mesh.use_auto_smooth = True
        mesh.auto_smooth_angle = math.pi
    mesh.normals_split_custom_set_from_vertices(solid.normals.tolist())
