"""What scripts in Blender share. The first argument is the file for what they find."""

import importlib
import json
import pathlib
import sys
import time

import bpy

FOUND, *ARGUMENTS = sys.argv[sys.argv.index("--") + 1 :]
EXTENSION = bpy.app.version >= (4, 2, 0)
ADDON = "bl_ext.user_default.caustic_block" if EXTENSION else "caustic_block"


def tell(**found):
    pathlib.Path(FOUND).write_text(json.dumps(found))


def enable():
    bpy.ops.preferences.addon_enable(module=ADDON)
    assert ADDON in bpy.context.preferences.addons, "the add-on is not enabled"


def part(name):
    """A module of the add-on."""
    return importlib.import_module(f"{ADDON}.{name}")


def empty():
    """A file with nothing in it."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    if ADDON not in bpy.context.preferences.addons:
        enable()


def add(picture, **settings):
    """A new block."""
    assert bpy.ops.mesh.caustic_block_add(filepath=str(picture), **settings) == {"FINISHED"}
    return bpy.context.object


def settle(seconds=60.0):
    """Lets go on what is going on, until nothing is."""
    jobs, end = part("jobs"), time.monotonic() + seconds
    while jobs.busy():
        assert time.monotonic() < end, "it does not end"
        jobs.pump()
        time.sleep(0.01)


def solve(thing):
    bpy.context.view_layer.objects.active = thing
    return bpy.ops.object.caustic_block_solve()


def refused(call, *words, **options):
    """Calls an operator that must report an error with these words in it."""
    try:
        found = call(**options)
    except RuntimeError as error:
        missing = [word for word in words if word not in str(error)]
        assert not missing, f"{missing} not in: {error}"
        return str(error)
    raise AssertionError(f"not refused: {found}")
