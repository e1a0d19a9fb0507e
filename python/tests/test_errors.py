"""What goes wrong is told by an exception of a kind, with the setting and its value."""

from __future__ import annotations

import pathlib
import pickle
from typing import Any, Callable

import numpy as np
import pytest

import glasswarp as gw

PICTURE = np.eye(16) + 0.5

CASES: list[tuple[Callable[[], Any], type[gw.GlasswarpError], str, Any, str]] = [
    (lambda: gw.Bench(distanc_mm=3), gw.UnknownSetting, "distanc_mm", 3, "did you mean distance_mm"),  # type: ignore[call-arg]
    (lambda: gw.Bench(distance_mm="25cm"), gw.BadInput, "distance_mm", "25cm", "keyword distance"),  # type: ignore[arg-type]
    (lambda: gw.Bench(distance="3 furlongs"), gw.BadInput, "distance", "3 furlongs", "unknown unit 'furlongs'"),
    (lambda: gw.Bench(distance_mm=-1), gw.BadInput, "distance_mm", -1, "distance"),
    (lambda: gw.Bench(distance_mm=float("nan")), gw.BadInput, "distance_mm", None, "no length"),
    (lambda: gw.Bench(distance_mm=250, distance="25cm"), gw.BadInput, "distance", "25cm", "distance_mm says already"),
    (lambda: gw.Bench(material="pmm"), gw.BadInput, "material", "pmm", "did you mean 'pmma'"),
    (lambda: gw.Bench(ior=1.5, material="bk7"), gw.BadInput, "ior", 1.5, "material"),
    (lambda: gw.Bench(tilt_deg=80), gw.BadInput, "tilt_deg", 80, "between 0 and 75 degrees"),
    (lambda: gw.Bench(mirror="yes"), gw.BadInput, "mirror", "yes", "True or False"),  # type: ignore[arg-type]
    (lambda: gw.Bench(nodes=2.5), gw.BadInput, "nodes", 2.5, "invalid digit"),  # type: ignore[arg-type]
    (lambda: gw.design(PICTURE, nodes=3), gw.BadInput, "nodes", 3, "between 9 and 8193"),
    (lambda: gw.design(PICTURE, rim_mm=(5, 1), mark_mm=50, nodes=33), gw.BadInput, "mark_mm", 50, "mark"),
    (lambda: gw.design(np.ones((2, 2, 2))), gw.BadInput, "picture", (2, 2, 2), "two dimensions"),
    (lambda: gw.design(-PICTURE), gw.BadInput, "picture", -1.5, "not negative"),
    (lambda: gw.design(np.full((8, 8), np.inf)), gw.BadInput, "picture", np.inf, "finite"),
    (lambda: gw.design(np.zeros((8, 8))), gw.BadInput, "picture", 0.0, "no light"),
    (lambda: gw.design(PICTURE * 1j), gw.BadInput, "picture", np.dtype(complex), "real numbers"),
    (lambda: gw.command("desing"), gw.BadInput, "name", "desing", "there is no command"),
    (lambda: gw.batch([gw.Task(gw.materials)], object()), gw.BadInput, "executor", None, "submit"),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case[2]}-{case[4]}")
def test_a_mistake_names_its_setting_and_value(
    case: tuple[Callable[[], Any], type[gw.GlasswarpError], str, Any, str],
) -> None:
    call, kind, setting, value, says = case
    with pytest.raises(kind) as raised:
        call()
    error = raised.value
    assert type(error) is kind and error.setting == setting and says in str(error), str(error)
    if value is not None:
        assert error.value == value
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.setting) == (kind, str(error), setting)


def test_the_hierarchy_is_small_and_meets_that_of_python() -> None:
    assert issubclass(gw.BadInput, ValueError) and issubclass(gw.UnknownSetting, TypeError)
    assert issubclass(gw.FileError, OSError) and issubclass(gw.NotASolid, gw.BadInput)
    kinds = (gw.BadInput, gw.FileError, gw.FellShort, gw.NotASolid, gw.UnknownSetting)
    assert all(issubclass(kind, gw.GlasswarpError) for kind in kinds)


def test_files_that_are_missing_broken_or_no_solid(tmp_path: pathlib.Path) -> None:
    with pytest.raises(gw.FileError, match="cannot be read") as raised:
        gw.design(tmp_path / "none.png")
    assert raised.value.causes and "No such file" in raised.value.causes[0]
    (tmp_path / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\nnonsense")
    with pytest.raises(gw.GlasswarpError, match="broken.png"):
        gw.design(tmp_path / "broken.png")
    (tmp_path / "open.stl").write_text(
        "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid x\n"
    )
    with pytest.raises(gw.NotASolid):
        gw.verify(tmp_path / "open.stl", ior=1.5, distance_mm=100)


def test_falling_short_keeps_what_was_found(block: gw.Block) -> None:
    with pytest.raises(gw.FellShort, match="max_error") as raised:
        block.verify(max_error=1e-9, photons=10_000)
    assert raised.value.setting == "max_error" and raised.value.value == 1e-9
    assert raised.value.result.judgement.picture.rel_rms > 1e-9


def test_calls_for_other_things_are_named(block: gw.Block, tmp_path: pathlib.Path) -> None:
    with pytest.raises(gw.BadInput, match="asked by photons"):
        gw.verify(block, tally=tmp_path / "t.exr")  # type: ignore[call-arg]
    with pytest.raises(gw.BadInput, match="program judges it"):
        gw.verify("portrait.ngc")
    with pytest.raises(gw.BadInput, match="mill"):
        block.save(tmp_path / "b.ngc")
    with pytest.raises(gw.BadInput, match="is no program"):
        gw.program("portrait.stl")


def test_a_block_says_what_may_not_be_meant(picture: pathlib.Path) -> None:
    block = gw.design(picture, nodes=33)
    assert any("source_size" in text and "--" not in text for text in block.summary.warnings)
