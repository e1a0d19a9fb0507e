"""What is asked of blocks and files."""

from __future__ import annotations

import json
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import glasswarp as gw


def test_verify_gives_light_figures_and_record(block: gw.Block, tmp_path: pathlib.Path) -> None:
    found = gw.verify(block, photons=100_000)
    assert found.relative_rms is not None and found.relative_rms < 0.02
    assert found.ssim is not None and found.ssim > 0.99
    assert found.irradiance.shape == (48, 64) and found.target is not None
    # Both are compared with their mean at 1.
    drawn, wanted = (light / light.mean() for light in (found.irradiance, found.target))
    error = np.sqrt(np.mean((drawn - wanted) ** 2))
    assert error == pytest.approx(found.relative_rms, rel=1e-9)
    assert sum(
        found.flux.as_dict()[part]
        for part in ("window", "missed", "side", "totally_reflected", "beside", "lost", "reflected")
    ) == pytest.approx(1.0, abs=1e-9)
    # Left is left, and the top is the top.
    spot = np.unravel_index(found.irradiance.argmax(), found.irradiance.shape)
    assert spot[1] < 24 and 20 < spot[0] < 28
    assert found._repr_html_().count("data:image/png;base64,") == 2 and "relative RMS" in repr(found)


def test_verify_is_the_command(block: gw.Block, tmp_path: pathlib.Path) -> None:
    block.save(tmp_path / "b.stl")
    words = [sys.executable, "-m", "glasswarp", "verify", "b.stl", "--photons=20000", "--json"]
    told = json.loads(subprocess.run(words, cwd=tmp_path, capture_output=True, check=True).stdout)
    found = gw.verify(tmp_path / "b.stl", photons=20_000)
    assert told["result"]["judgement"]["picture"]["rel_rms"] == found.record.judgement.picture.rel_rms  # type: ignore[union-attr]
    assert told["warnings"] == []


def test_white_light_has_three_colours(block: gw.Block, tmp_path: pathlib.Path) -> None:
    found = gw.verify(block, photons=10_000, white=tmp_path / "w.png")
    assert found.white is not None and found.white.shape[2] == 3 and (tmp_path / "w.png").exists()


def test_another_solid_needs_no_picture(block: gw.Block, tmp_path: pathlib.Path) -> None:
    block.save(tmp_path / "b.stl")
    (tmp_path / "b.toml").unlink()
    found = gw.verify(tmp_path / "b.stl", ior=1.49, distance_mm=200, photons=10_000)
    assert found.target is None and found.relative_rms is None and "no picture" in repr(found)


def test_photons_add_up_to_one_run_byte_by_byte(block: gw.Block, tmp_path: pathlib.Path) -> None:
    options = {"photons": 64_000, "seed": 5, "replicates": 8}
    whole = gw.photons(block, tmp_path / "whole.exr", **options)  # type: ignore[arg-type]
    for k in (1, 2, 3):
        part = gw.photons(block, tmp_path / f"{k}.exr", shard=f"{k}/3", **options)  # type: ignore[arg-type]
        assert not part.complete
    merged = gw.merge(*(tmp_path / f"{k}.exr" for k in (3, 1, 2)), tally=tmp_path / "merged.exr")
    assert merged == gw.merge(tmp_path / "whole.exr") and whole.complete
    assert (tmp_path / "merged.exr").read_bytes() == (tmp_path / "whole.exr").read_bytes()


def test_a_sweep_is_a_table_and_its_light(block: gw.Block) -> None:
    swept = gw.sweep(block, "distance", 100, 400, steps=3, pixels=32)
    assert swept.record.swept == "distance_mm" and np.allclose(swept.column("value"), [100, 200, 400])
    assert swept.lights["plane"].shape == (3, 24, 32)
    plane, displaced = swept.column("plane_moves"), swept.column("displaced")
    assert (np.diff(plane) < 0).all() and (displaced < plane).all()
    built = gw.sweep(block, "distance", 150, 250, steps=2, as_built=True, pixels=32)
    assert len(built.record.points) == 2


def test_checks_milling_and_readiness_answer(block: gw.Block, tmp_path: pathlib.Path) -> None:
    found = gw.check(block, cutter="ball:d3mm", step_over_mm=0.1)
    assert found.lines and not any("--" in line.says for line in found.lines)
    assert not gw.check(block, max_slope_deg=0.1).makeable
    milled = gw.mill(block, cutter="ball:d6mm", step_over="0.3mm", polish_mm=0.1, pixels=32)
    assert milled.cutter and [step.name for step in milled.steps]
    ready = gw.ready(block, cutter="ball:d6mm", output=tmp_path / "sheet.html")
    assert ready.verdict.answer and (tmp_path / "sheet.html").exists()


def test_a_program_is_written_and_judged(block: gw.Block, tmp_path: pathlib.Path) -> None:
    block.save(tmp_path / "b.stl")
    milled = gw.mill(tmp_path / "b.stl", step_over_mm=2, output=tmp_path / "b.ngc", pixels=32)
    assert milled.programs and milled.programs[0].moves > 0
    judged = gw.program(tmp_path / "b.ngc", pixels=32)
    assert judged.faults == () and judged.feed_moves > 0


def test_previews_and_coupons_write_where_they_are_told(
    picture: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.warns(gw.GlasswarpWarning):
        assert gw.preview(picture, nodes=33, output="p.png").files == ("p.png",)
    coupon = gw.coupon(output=["c.stl", "c.html"], lamp_distance="2m")
    assert coupon.lamp_distance_mm == 2000 and coupon.files == ("c.stl", "c.html")


def test_materials_and_presets_are_listed() -> None:
    assert {"pmma", "bk7"} <= {material.name for material in gw.materials()}
    assert all(preset.design for preset in gw.presets())


def test_records_are_plain_frozen_data() -> None:
    material = gw.materials()[0]
    assert material.as_dict()["name"] == material.name
    with pytest.raises(AttributeError):
        material.ior = 2.0  # type: ignore[misc]


def test_the_command_of_the_wheel_is_the_program(tmp_path: pathlib.Path) -> None:
    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-m", "glasswarp", *words], cwd=tmp_path, capture_output=True, text=True)

    assert run("--version").stdout == f"glasswarp {gw.__version__}\n"
    assert run("materials").stdout.startswith("name")
    wrong = run("design", "none.png")
    assert wrong.returncode == 1 and "cannot be read" in wrong.stderr
    assert run("design", "none.png", "--nodes=two").returncode == 2
    told = json.loads(run("verify", "none.stl", "--json").stdout)
    assert told["exit_code"] == 1 and told["error"]["kind"] == "file"
