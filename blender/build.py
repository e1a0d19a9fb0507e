#!/usr/bin/env python3
"""Packs the add-on and wheels of glasswarp into one zip, which Blender 3.4 to 4.1 take as an add-on, and later ones as an extension.

    python blender/build.py -o caustic_block.zip target/wheels/glasswarp-*.whl

The same files give the same bytes.
"""

import argparse
import pathlib
import sys
import zipfile

HERE = pathlib.Path(__file__).parent
NAME = "caustic_block"
#: What wheels call a platform, and what Blender calls it.
PLATFORMS = {
    ("linux", "x86_64"): "linux-x64",
    ("linux", "aarch64"): "linux-arm64",
    ("macosx", "x86_64"): "macos-x64",
    ("macosx", "arm64"): "macos-arm64",
    ("win", "amd64"): "windows-x64",
    ("win", "arm64"): "windows-arm64",
}


def platform_of(wheel):
    """Blender's name of the platform of a wheel that any Python from 3.9 on can import."""
    parts = wheel.stem.split("-")
    if len(parts) != 5 or parts[0] != "glasswarp" or "abi3" not in parts[3].split("."):
        raise SystemExit(f"{wheel.name} is no wheel of glasswarp for the stable ABI")
    for (system, machine), name in PLATFORMS.items():
        if system in parts[4] and parts[4].endswith(machine):
            return name
    raise SystemExit(f"{wheel.name} is for a platform that Blender has no name for")


def pack(wheels, output):
    """Writes the zip."""
    wheels = sorted(wheels, key=lambda wheel: wheel.name)
    versions = sorted({wheel.stem.split("-")[1] for wheel in wheels})
    platforms = [platform_of(wheel) for wheel in wheels]
    if len(versions) != 1 or len(set(platforms)) != len(wheels):
        raise SystemExit(f"wheels of one version, and one for each platform: {', '.join(wheel.name for wheel in wheels)}")
    (version,) = versions
    files = {f"{NAME}/{path.name}": path.read_bytes() for path in (HERE / NAME).glob("*.py")}
    numbers = tuple(int(number) for number in version.split("."))
    init = files[f"{NAME}/__init__.py"]
    stamped = init.replace(b'"version": (0, 0, 0)', f'"version": {numbers}'.encode())
    if stamped == init:
        raise SystemExit("the add-on does not say its version where it should")
    files[f"{NAME}/__init__.py"] = stamped
    manifest = (HERE / NAME / "blender_manifest.toml").read_text(encoding="utf-8")
    head, table, permissions = manifest.partition("\n[permissions]")
    listed = "".join(f'  "./wheels/{wheel.name}",\n' for wheel in wheels)
    quoted = ", ".join(f'"{platform}"' for platform in sorted(platforms))
    head = head.rstrip() + f'\nversion = "{version}"\nplatforms = [{quoted}]\nwheels = [\n{listed}]\n'
    files[f"{NAME}/blender_manifest.toml"] = (head + table + permissions).encode()
    for name in ("LICENSE-MIT", "LICENSE-APACHE"):
        files[f"{NAME}/{name}"] = (HERE.parent / name).read_bytes()
    for wheel in wheels:
        files[f"{NAME}/wheels/{wheel.name}"] = wheel.read_bytes()
    with zipfile.ZipFile(output, "w") as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.create_system = 3
            entry.external_attr = 0o100644 << 16
            # Wheels are packed already.
            entry.compress_type = zipfile.ZIP_STORED if name.endswith(".whl") else zipfile.ZIP_DEFLATED
            archive.writestr(entry, files[name])


def main(words):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wheels", nargs="+", type=pathlib.Path, help="wheels of glasswarp, one for each platform")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(f"{NAME}.zip"))
    given = parser.parse_args(words)
    pack(given.wheels, given.output)
    print(f"{given.output}, {given.output.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main(sys.argv[1:])
