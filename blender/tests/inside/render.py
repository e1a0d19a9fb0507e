"""Renders the receiver of blocks on several benches, and compares it with what the verifier finds in the exported file."""

import math
import sys

import bpy
import numpy as np

sys.path.insert(0, __file__.rpartition("/")[0])
from common import ARGUMENTS, FOUND, add, empty, enable, part, solve, tell  # noqa: E402

picture, benches = ARGUMENTS[0], eval(ARGUMENTS[1])
enable()
import glasswarp as gw  # noqa: E402

#: Across: 3:2 in whole pixels.
PIXELS = 129


def rendered():
    """The linear light that the scene's camera sees, top row first."""
    scene = bpy.context.scene
    world = bpy.data.worlds.new("dark")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    scene.world = world
    scene.cycles.samples, scene.cycles.seed = 16, 1
    # Every pixel is the mean of its own light.
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
    scene.render.filepath = FOUND + ".exr"
    bpy.ops.render.render(write_still=True)
    read = bpy.data.images.load(scene.render.filepath)
    values = np.empty(len(read.pixels), np.float32)
    read.pixels.foreach_get(values)
    return values.reshape(read.size[1], read.size[0], -1)[::-1, :, 0].astype(float)


def difference(one, other, lit):
    """Relative RMS difference over the inner nine tenths."""
    inner = np.zeros(lit.shape, bool)
    rim = math.ceil(0.05 * max(lit.shape))
    inner[rim:-rim, rim:-rim] = True
    one, other = one[lit & inner], other[lit & inner]
    return math.sqrt(np.mean((one / one.mean() - other / other.mean()) ** 2))


def found(bench):
    empty()
    render = bpy.context.scene.render
    render.resolution_x = render.resolution_y = PIXELS
    thing = add(picture, offset=0.3, live=False)
    for name, value in bench.items():
        setattr(thing.caustic_block, name, value)
    thing.caustic_block.nodes = 257
    assert solve(thing) == {"FINISHED"}
    bpy.ops.object.caustic_block_cycles()
    light = rendered()
    block = part("jobs").solved(thing)
    judged = gw.verify(block, pixels=PIXELS, photons=10_000)
    truth = judged.irradiance
    assert light.shape == truth.shape
    lit = light > 0
    return {
        "difference": difference(light, truth, lit),
        "upside_down": difference(light, truth[::-1], lit),
        "mirrored": difference(light, truth[:, ::-1], lit),
        "black": int((~lit).sum()),
        "of": lit.size,
        # 1 where the picture is brightest, less what is reflected.
        "strength": light.mean() * block.target.max(),
        "block": judged.relative_rms,
        "unit": bpy.context.scene.unit_settings.scale_length,
    }


tell(benches=[found(bench) for bench in benches])
