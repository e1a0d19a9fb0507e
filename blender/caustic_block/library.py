"""The wheel of glasswarp that comes with the add-on.

As an extension (Blender 4.2 and later) Blender itself installs the wheel. As an add-on of older Blenders the wheel is unpacked here, into
the add-on's own folder, because native code cannot be imported from within an archive.
"""

import importlib
import pathlib
import shutil
import sys
import sysconfig
import tempfile
import zipfile

HERE = pathlib.Path(__file__).parent
WHEELS = HERE / "wheels"
UNPACKED = HERE / "unpacked"


def load():
    """Makes `import glasswarp` find the glasswarp of this add-on.

    Raises:
        ImportError: There is no wheel for this machine, its folder cannot be written, or another glasswarp is loaded already.
    """
    if is_extension():
        importlib.import_module("glasswarp")
        return
    folder = unpacked()
    loaded = sys.modules.get("glasswarp")
    if loaded is not None:
        if folder in pathlib.Path(loaded.__file__).parents:
            return
        raise ImportError(f"another glasswarp is loaded, from {loaded.__file__}: restart Blender without it")
    sys.path.insert(0, str(folder))
    try:
        importlib.import_module("glasswarp")
    finally:
        sys.path.remove(str(folder))
    # What glasswarp imports later, within itself, goes by its own path.


def is_extension():
    """Whether Blender has installed this as an extension, wheels and all."""
    return __package__.startswith("bl_ext.")


def unpacked():
    """The folder in which the wheel for this machine lies unpacked."""
    wheel = wheel_for(sysconfig.get_platform())
    folder = UNPACKED / wheel.stem
    if folder.is_dir():
        return folder
    try:
        UNPACKED.mkdir(exist_ok=True)
        # Renamed when it is whole: two Blenders may start at once.
        making = pathlib.Path(tempfile.mkdtemp(dir=UNPACKED))
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(making)
        making.rename(folder)
    except OSError as error:
        if folder.is_dir():
            shutil.rmtree(making, ignore_errors=True)
            return folder
        raise ImportError(f"glasswarp cannot be unpacked into the add-on's folder {UNPACKED}: {error}") from error
    return folder


def wheel_for(platform):
    """The wheel for a platform, as `sysconfig` calls it."""
    system, _, machine = platform.replace("-", "_").replace(".", "_").partition("_")
    machine = next((name for name in ("x86_64", "amd64", "arm64", "aarch64") if machine.endswith(name)), machine)
    found = sorted(WHEELS.glob("glasswarp-*.whl"))
    for wheel in found:
        tag = wheel.stem.split("-")[-1]
        if system in tag and (tag.endswith(machine) or tag.endswith("universal2")):
            return wheel
    names = ", ".join(wheel.name for wheel in found) or "none"
    raise ImportError(f"this add-on has no glasswarp for {platform}: get the one for your system (it has: {names})")
