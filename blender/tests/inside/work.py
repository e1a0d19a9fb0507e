"""Drafts, solves, cancelling, several blocks, undo."""

import sys
import time

import bpy
import numpy as np

sys.path.insert(0, __file__.rpartition("/")[0])
from common import ARGUMENTS, add, empty, enable, part, settle, solve, tell  # noqa: E402

picture, other_picture = ARGUMENTS
enable()
jobs = part("jobs")


def places(thing):
    found = np.empty(3 * len(thing.data.vertices), np.float32)
    thing.data.vertices.foreach_get("co", found)
    return found.reshape(-1, 3)


def width_mm(thing):
    return 1000 * np.ptp(places(thing)[:, 0]) * bpy.context.scene.unit_settings.scale_length


# A block is there at once, and a finer draft of it a moment later.
empty()
block = add(picture)
wanted = block.caustic_block
first = len(block.data.vertices)
assert first > 65 * 40 and wanted.shown_nodes == 65 and jobs.busy()
settle()
assert wanted.shown_nodes == 129 and len(block.data.vertices) > max(first, 129 * 86) and not wanted.fault
assert abs(width_mm(block) - 100) < 1e-3

# A setting is changed, several times at once: one draft, of the last.
for size in (70, 80, 90):
    wanted.size_mm = size
assert jobs.busy() and abs(width_mm(block) - 100) < 1e-3
settle()
assert abs(width_mm(block) - 90) < 1e-3 and wanted.shown_nodes == 129

# Where it is not to, it does not.
wanted.live = False
settle()
wanted.size_mm = 95
assert not jobs.busy() and abs(width_mm(block) - 90) < 1e-3 and not part("settings").fits(block)

# A solve, which comes to what glasswarp comes to alone.
wanted.nodes = 193
assert solve(block) == {"FINISHED"}
assert wanted.shown_nodes == 193 and abs(width_mm(block) - 95) < 1e-3
import glasswarp as gw  # noqa: E402

alone = gw.design(picture, size_mm=95, nodes=193)
assert np.array_equal(jobs.solved(block).heights_mm, alone.heights_mm)
per_mm = 0.001 / bpy.context.scene.unit_settings.scale_length
assert np.abs(places(block)[: 193 * 129, 2].reshape(129, 193) / per_mm - alone.heights_mm).max() < 1e-4

# The normals are those of the smooth face.
normals = part("solid").exported(alone)[0].normals
mesh = block.data
if hasattr(mesh, "calc_normals_split"):
    mesh.calc_normals_split()
    kept = np.empty(3 * len(mesh.loops), np.float32)
    mesh.loops.foreach_get("normal", kept)
else:
    kept = np.empty(3 * len(mesh.loops), np.float32)
    mesh.corner_normals.foreach_get("vector", kept)
corners = np.empty(len(mesh.loops), np.int32)
mesh.loops.foreach_get("vertex_index", corners)
off = np.abs(kept.reshape(-1, 3) - normals[corners]).max()

# Cancelled: what was there stays, and the thread ends.
wanted.nodes = 1025
wanted.size_mm = 60
job = jobs.start(block, draft=False)
while job.stage in ("waiting", "starting"):
    time.sleep(0.01)
begun = time.monotonic()
bpy.context.view_layer.objects.active = block
bpy.ops.object.caustic_block_cancel()
job.join(20)
took = time.monotonic() - begun
assert not job.is_alive() and isinstance(job.error, jobs.Cancelled) and jobs.job_of(block) is None
settle()
assert wanted.shown_nodes == 193 and not wanted.fault and abs(width_mm(block) - 95) < 1e-3

# A setting that changes under a solve: its outcome is not shown as if it were of the new one.
wanted.nodes = 257
job = jobs.start(block, draft=False)
wanted.size_mm = 65
settle()
assert wanted.shown_nodes == 193 and isinstance(job.error, jobs.Cancelled)

# An object that goes meanwhile.
short = add(picture, live=False)
job = jobs.start(short, draft=False)
bpy.data.objects.remove(short)
settle()
job.join(20)
assert job.cancelled

# A second block, with another picture: both keep what is theirs.
second = add(other_picture, size_mm=50)
assert second != block and second.caustic_block.uid != wanted.uid
wanted.live = True
wanted.size_mm = 75
settle()
assert abs(width_mm(block) - 75) < 1e-3 and abs(width_mm(second) - 50) < 1e-3
assert second.caustic_block.image.name != wanted.image.name
assert wanted.lamp != second.caustic_block.lamp and second.caustic_block.lamp.parent == second

# A duplicate is a block of its own, and leaves the bench to the first.
for each in bpy.context.selected_objects:
    each.select_set(False)
block.select_set(True)
bpy.context.view_layer.objects.active = block
bpy.ops.object.duplicate()
third = bpy.context.object
third.caustic_block.size_mm = 40
settle()
assert third != block and third.caustic_block.uid != wanted.uid
assert abs(width_mm(third) - 40) < 1e-3 and abs(width_mm(block) - 75) < 1e-3
assert third.caustic_block.lamp is None and wanted.lamp.parent == block

# The light needs no new face.
settings = part("settings")
before, energy = settings.shown(block), wanted.lamp.data.energy
wanted.brightness = 2
assert abs(wanted.lamp.data.energy / energy - 2) < 1e-5 and not jobs.busy() and settings.shown(block) == before
# It stays as wide as it is when the scene counts otherwise.
bpy.context.scene.unit_settings.scale_length = 0.1
bpy.context.view_layer.objects.active = block
bpy.ops.object.caustic_block_bench()
assert abs(width_mm(block) - 75) < 1e-3

# Undo takes a setting back; the face follows.
bpy.ops.ed.undo_push(message="before")
name = block.name
block.caustic_block.size_mm = 85
bpy.ops.ed.undo_push(message="wider")
settle()
assert abs(width_mm(block) - 85) < 1e-3
bpy.ops.ed.undo()
block = bpy.data.objects[name]
assert abs(block.caustic_block.size_mm - 75) < 1e-4
settle()
assert settings.fits(block)
assert abs(width_mm(block) - 75) < 1e-3
bpy.ops.ed.redo()
block = bpy.data.objects[name]
settle()
assert abs(width_mm(block) - 85) < 1e-3

# Nothing is left behind.
menus = [bpy.types.VIEW3D_MT_mesh_add, bpy.types.TOPBAR_MT_file_export]
drawn = [len(menu._dyn_ui_initialize()) for menu in menus]
block.caustic_block.size_mm = 55
assert jobs.busy()
bpy.ops.preferences.addon_disable(module=jobs.__package__)
assert not hasattr(bpy.types.Object, "caustic_block") and not hasattr(bpy.types, "CAUSTICBLOCK_PT_block")
assert [len(menu._dyn_ui_initialize()) for menu in menus] == [number - 1 for number in drawn]
assert not jobs.busy() and not any("caustic_block" in one.__module__ for one in bpy.app.handlers.load_pre)
enable()
tell(normals_off=float(off), cancelled_after_s=took)
