"""What tests share: the zip, and Blenders into which it is installed, each with user folders of its own."""

import json
import os
import pathlib
import shutil
import subprocess
import sys

import pytest

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parents[1]
SAMPLES = ROOT / "samples"
sys.path.insert(0, str(HERE.parent))


def wheels():
    """The wheels to pack: those of `GLASSWARP_WHEELS`, or of the folder where `.ci/run` leaves them."""
    folder = pathlib.Path(os.environ.get("GLASSWARP_WHEELS", ROOT / "target" / "wheels"))
    found = sorted(folder.glob("glasswarp-*.whl"))
    assert found, f"no wheel of glasswarp in {folder}: see docs/python.md"
    return found


@pytest.fixture(scope="session")
def archive(tmp_path_factory):
    import build

    made = tmp_path_factory.mktemp("zip") / "caustic_block.zip"
    build.pack(wheels(), made)
    return made


class Host:
    """A Blender that runs scripts of `inside/`."""

    def __init__(self, words, folder):
        self.words = words
        self.folder = folder
        own = {"CONFIG": "config", "SCRIPTS": "scripts", "DATAFILES": "data", "EXTENSIONS": "extensions", "RESOURCES": "."}
        for name in own.values():
            (folder / name).mkdir(exist_ok=True)
        self.environment = {
            **os.environ,
            **{f"BLENDER_USER_{key}": str(folder / name) for key, name in own.items()},
            "HOME": str(folder),
            "TMPDIR": str(folder),
            # The glasswarp that is tested is that of the zip.
            "PYTHONNOUSERSITE": "1",
        }
        self.environment.pop("PYTHONPATH", None)

    def run(self, script, *arguments):
        """What a script has found."""
        found = self.folder / f"{script}.json"
        found.unlink(missing_ok=True)
        words = [*self.words, str(HERE / "inside" / f"{script}.py"), "--", str(found), *map(str, arguments)]
        ran = subprocess.run(words, env=self.environment, cwd=self.folder, capture_output=True, text=True, timeout=300)
        assert ran.returncode == 0 and found.exists(), f"{script}\n{ran.stdout[-4000:]}\n{ran.stderr[-4000:]}"
        return json.loads(found.read_text())


#: `bpy` is Blender as a module: an interpreter that has it is named in `GLASSWARP_BPY`.
def _words(name):
    if name == "blender":
        program = shutil.which("blender")
        return program and [program, "-b", "--factory-startup", "-noaudio", "--python-exit-code", "1", "-P"]
    program = os.environ.get("GLASSWARP_BPY")
    return program and [program]


@pytest.fixture(scope="session", params=["blender", "bpy"])
def host(request, archive, tmp_path_factory):
    words = _words(request.param)
    if not words:
        missing = f"{request.param} is not here, and was not tested (Debian: blender; pip install bpy, GLASSWARP_BPY)"
        assert request.param != "blender" or "GLASSWARP_REQUIRE_TOOLS" not in os.environ, missing
        pytest.skip(missing)
    made = Host(words, tmp_path_factory.mktemp(request.param))
    made.installed = made.run("install", archive)
    return made


@pytest.fixture(scope="session")
def picture():
    """Smooth gradients, 3:2."""
    return SAMPLES / "rosette" / "target.png"
