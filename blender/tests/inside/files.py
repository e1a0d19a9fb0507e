"""Pictures that cannot be, exports, and .blend files."""

import hashlib
import os
import pathlib
import sys

import bpy
import numpy as np

sys.path.insert(0, __file__.rpartition("/")[0])
from common import ARGUMENTS, add, empty, enable, part, refused, settle, solve, tell  # noqa: E402

picture = pathlib.Path(ARGUMENTS[0])
folder = pathlib.Path(ARGUMENTS[1])
enable()
import glasswarp as gw  # noqa: E402

jobs = part("jobs")
export = bpy.ops.export_mesh.caustic_block


def everything():
    kinds = ("objects", "meshes", "images", "lights", "cameras", "materials")
    return {kind: len(getattr(bpy.data, kind)) for kind in kinds}


def digest(file):
    return hashlib.sha256(pathlib.Path(file).read_bytes()).hexdigest()


# What cannot be is refused in glasswarp's words, and leaves nothing.
empty()
before = everything()
adds = bpy.ops.mesh.caustic_block_add
broken = folder / "broken.png"
broken.write_bytes(picture.read_bytes()[:300])
refused(adds, "broken.png", filepath=str(broken))
refused(adds, "is not there", filepath=str(folder / "missing.png"))
refused(adds, "no picture")
refused(adds, "no image 'none'", image="none")
refused(adds, "distance", filepath=str(picture), distance_mm=1e7)
assert everything() == before and not jobs.busy()

# Settings that cannot be: the words are kept for the panel, the block stays.
block = add(picture, live=False)
wanted = block.caustic_block
count = len(block.data.vertices)
wanted.material = "unobtainium"
words = refused(bpy.ops.object.caustic_block_solve, "unobtainium")
assert "unobtainium" in wanted.fault and len(block.data.vertices) == count
wanted.material = "bk7"
wanted.source_size, wanted.light = "5x3mm", "point"
refused(bpy.ops.object.caustic_block_solve, "round lights only", "5x3mm")
wanted.source_size, wanted.light = "", "parallel"
wanted.nodes = 129
assert solve(block) == {"FINISHED"} and not wanted.fault
index = wanted.glass.node_tree.nodes[0].inputs["IOR"].default_value
assert abs(index - 1.5168) < 1e-6, index

# Files are those of glasswarp.
names = ["block.stl", "block.step", "block.3mf", "block.obj", "block.ply", "block.glb", "heights.exr", "heights.png"]
for name in names:
    assert export(filepath=str(folder / name)) == {"FINISHED"}
    assert (folder / name).stat().st_size > 1000
alone = gw.design(picture, material="bk7", nodes=129)
(folder / "alone").mkdir()
alone.save(folder / "alone" / "block.stl", folder / "alone" / "block.step")
assert digest(folder / "alone" / "block.stl") == digest(folder / "block.stl")
assert gw.verify(folder / "block.stl", photons=10_000).relative_rms < 0.02

# Nothing of somebody else's is replaced, nor the picture.
foreign = folder / "foreign.stl"
foreign.write_text("mine")
refused(export, "was not written by glasswarp", filepath=str(foreign))
assert foreign.read_text() == "mine"
assert export(filepath=str(foreign), force=True) == {"FINISHED"} and foreign.stat().st_size > 1000
own = folder / "own.png"
own.write_bytes(picture.read_bytes())
wanted.image = bpy.data.images.load(str(own))
refused(export, "own.png", filepath=str(own), force=True)
assert digest(own) == digest(picture)
refused(export, "", filepath=str(folder / "block.dwg"))
refused(export, "", filepath=str(folder / "no" / "such" / "folder" / "block.stl"))

# A name without an extension gets the format's.
assert export(filepath=str(folder / "named"), format=".3mf") == {"FINISHED"} and (folder / "named.3mf").exists()

# Opened again it is the same, and can be solved and exported again.
wanted.image = bpy.data.images.load(str(picture), check_existing=True)
wanted.offset = 0.2
wanted.live = True
settle()
assert wanted.shown_nodes == 129
saved = folder / "saved.blend"
bpy.ops.wm.save_as_mainfile(filepath=str(saved))
name, kept = (
    block.name,
    {key: getattr(wanted, key) for key in ("uid", "size_mm", "offset", "material", "bench", "nodes")},
)
empty()
assert not bpy.data.objects
bpy.ops.wm.open_mainfile(filepath=str(saved))
block = bpy.data.objects[name]
wanted = block.caustic_block
assert {key: getattr(wanted, key) for key in kept} == kept
assert part("settings").fits(block) and wanted.image is not None and wanted.lamp.parent == block and not jobs.busy()
bpy.context.view_layer.objects.active = block
assert export(filepath=str(folder / "again.stl")) == {"FINISHED"}
gw.design(picture, material="bk7", nodes=129, offset=0.2).save(folder / "alone" / "again.stl")
assert digest(folder / "alone" / "again.stl") == digest(folder / "again.stl")

# The same picture, whether it is a file, packed, or made in Blender.
image = wanted.image
image.colorspace_settings.name = "sRGB"
wanted.live = False
wanted.nodes = 65
assert solve(block) == {"FINISHED"}
heights = jobs.solved(block).heights_mm
image.pack()
assert solve(block) == {"FINISHED"}
assert np.abs(jobs.solved(block).heights_mm - heights).max() < 1e-3 * np.ptp(heights)
made = bpy.data.images.new("made", 48, 32, float_buffer=True)
light = np.zeros((32, 48, 4), np.float32)
light[..., 3] = 1
light[24:, :24, :3] = 1
made.pixels.foreach_set(light.ravel())
wanted.image = made
assert solve(block) == {"FINISHED"}
target = jobs.solved(block).target
# Blender's rows begin at the bottom: bright at the top left.
assert target[:6, :20].min() > 3 * target[20:, 30:].max()
assert export(filepath=str(folder / "painted.stl")) == {"FINISHED"}
assert "painted.light.exr" in (folder / "painted.toml").read_text()
wanted.transfer, wanted.image = "srgb", None
assert not part("settings").fits(block)
refused(bpy.ops.object.caustic_block_solve, "no picture")
wanted.transfer = "AUTO"
strip = bpy.data.images.new("strip", 64, 64)
strip.source = "MOVIE"
wanted.image = strip
refused(bpy.ops.object.caustic_block_solve, "strip", "movie")
assert os.listdir(folder / "alone")
tell(files=sorted(os.listdir(folder)), words=words)
