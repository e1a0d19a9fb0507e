"""The zip."""

import pathlib
import sys
import zipfile

import pytest
from conftest import wheels

import build


def test_the_same_files_give_the_same_bytes(archive, tmp_path):
    again = tmp_path / "again.zip"
    build.pack(wheels(), again)
    assert again.read_bytes() == archive.read_bytes()


def test_a_zip_has_one_folder_a_manifest_and_all_wheels(archive, tmp_path):
    import shutil

    (wheel,) = wheels()
    other = tmp_path / wheel.name.replace("linux_x86_64", "win_amd64")
    shutil.copy(wheel, other)
    build.pack([wheel, other], tmp_path / "two.zip")
    with zipfile.ZipFile(tmp_path / "two.zip") as opened:
        names = opened.namelist()
        manifest = opened.read("caustic_block/blender_manifest.toml").decode()
    assert {name.split("/")[0] for name in names} == {"caustic_block"}
    assert 'platforms = ["linux-x64", "windows-x64"]' in manifest
    for each in (wheel, other):
        assert f"caustic_block/wheels/{each.name}" in names and f'"./wheels/{each.name}"' in manifest
    if sys.version_info >= (3, 11):
        import tomllib

        assert tomllib.loads(manifest)["version"] == wheel.name.split("-")[1]


@pytest.mark.parametrize(
    "names, words",
    [
        (["numpy-1.26.4-cp311-cp311-manylinux_2_17_x86_64.whl"], "no wheel of glasswarp"),
        (["glasswarp-0.1.0-cp39-abi3-plan9_mips.whl"], "no name for"),
        (["glasswarp-0.1.0-cp39-abi3-win_amd64.whl", "glasswarp-0.2.0-cp39-abi3-linux_x86_64.whl"], "one version"),
    ],
)
def test_wheels_that_do_not_go_together_are_refused(names, words, tmp_path):
    with pytest.raises(SystemExit, match=words):
        build.pack([pathlib.Path(name) for name in names], tmp_path / "none.zip")
    assert not (tmp_path / "none.zip").exists()


@pytest.mark.parametrize(
    "platform, tag",
    [
        ("linux-x86_64", "linux_x86_64"),
        ("linux-aarch64", "manylinux_2_28_aarch64"),
        ("win-amd64", "win_amd64"),
        ("macosx-11.0-arm64", "macosx_11_0_arm64"),
        ("macosx-10.15-x86_64", "macosx_10_12_x86_64"),
    ],
)
def test_an_older_blender_unpacks_the_wheel_of_its_machine(platform, tag, tmp_path, monkeypatch):
    from caustic_block import library

    monkeypatch.setattr(library, "WHEELS", tmp_path)
    for each in ("linux_x86_64", "manylinux_2_28_aarch64", "win_amd64", "macosx_11_0_arm64", "macosx_10_12_x86_64"):
        (tmp_path / f"glasswarp-0.1.0-cp39-abi3-{each}.whl").touch()
    assert library.wheel_for(platform).stem.endswith(tag)
    with pytest.raises(ImportError, match="plan9"):
        library.wheel_for("plan9-mips")
