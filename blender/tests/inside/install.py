"""Installs the zip as a user does, and looks where glasswarp comes from."""

import sys

import bpy

sys.path.insert(0, __file__.rpartition("/")[0])
import addon_utils  # noqa: E402
from common import ADDON, ARGUMENTS, EXTENSION, tell  # noqa: E402

(archive,) = ARGUMENTS
before = set(sys.path)
if EXTENSION:
    made = bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
else:
    made = bpy.ops.preferences.addon_install(filepath=archive)
    bpy.ops.preferences.addon_enable(module=ADDON)
assert made == {"FINISHED"}, made

import glasswarp  # noqa: E402

addon = sys.modules[ADDON]
tell(
    version=bpy.app.version_string,
    glasswarp=glasswarp.__file__,
    addon=addon.__file__,
    glasswarp_version=glasswarp.__version__,
    addon_version=addon_utils.module_bl_info(addon)["version"],
    paths=sorted(set(sys.path) - before),
)
