"""Blocks: what they hold, and that they are those of the command."""

from __future__ import annotations

import copy
import pathlib
import pickle
import threading

import numpy as np
import numpy.typing as npt
import pytest

import glasswarp as gw


def test_a_block_holds_heights_light_and_records(block: gw.Block, light: npt.NDArray[np.float64]) -> None:
    assert block.heights_mm.shape == (61, 81) and block.heights_mm.dtype == np.float64
    assert abs(block.heights_mm.mean()) < 1e-12
    assert block.size.relief_mm == pytest.approx(np.ptp(block.heights_mm), abs=0)
    assert block.size.width_mm == 60 and block.size.nodes == (81, 61)
    assert block.bench.distance_mm == 200 and block.bench.ior == 1.49
    assert block.summary.solver == "transport" and block.summary.iterations > 0 and block.summary.levels
    assert block.settings["nodes"] == 81 and block.settings["offset"] == 0.1
    # Arrays are kept in single precision, and the light has the mean 1.
    wanted = light / light.max() + 0.1
    assert np.allclose(block.target, wanted / wanted.mean(), rtol=1e-6)
    assert block.predicted is not None
    assert np.corrcoef(block.predicted.ravel(), block.target.ravel())[0, 1] > 0.999


def test_heights_are_lent_and_not_copied(block: gw.Block) -> None:
    one, two = block.heights_mm, block.heights_mm
    assert np.shares_memory(one, two) and not one.flags.writeable and not one.flags.owndata
    with pytest.raises(ValueError):
        one[0, 0] = 1.0
    with pytest.raises(ValueError):
        one.setflags(write=True)
    lent = gw.design(np.eye(16) + 1.0, nodes=17).heights_mm
    # The block is gone, what it has lent stays.
    assert np.isfinite(lent.sum())


def test_a_call_and_the_command_write_the_same_bytes(picture: pathlib.Path, tmp_path: pathlib.Path) -> None:
    with pytest.warns(gw.GlasswarpWarning, match="source_size"):
        made = gw.command("design", picture, output=tmp_path / "command.stl", nodes=65, no_report=True, no_verify=True)
    gw.design(picture, nodes=65).save(tmp_path / "call.stl")
    assert (tmp_path / "call.stl").read_bytes() == (tmp_path / "command.stl").read_bytes()
    assert made.as_dict()["files"] == (str(tmp_path / "command.stl"),)


def test_every_format_is_written_with_its_side_file(block: gw.Block, tmp_path: pathlib.Path) -> None:
    names = ["b.stl", "b.step", "b.3mf", "b.obj", "b.glb", "b.ply", "h.png", "h.exr"]
    notes = block.save(*(tmp_path / name for name in names))
    assert any("control points" in note for note in notes)
    assert all((tmp_path / name).stat().st_size > 0 for name in [*names, "b.toml", "h.toml"])
    # The light was an array: it lies beside the block, where the side file names it.
    assert "b.light.exr" in (tmp_path / "b.toml").read_text()
    assert gw.verify(tmp_path / "b.step", photons=10_000).relative_rms == pytest.approx(
        gw.verify(tmp_path / "b.stl", photons=10_000).relative_rms, rel=0.05
    )


def test_nothing_of_somebody_elses_is_replaced(block: gw.Block, tmp_path: pathlib.Path) -> None:
    foreign = tmp_path / "mine.stl"
    foreign.write_text("mine")
    with pytest.raises(gw.BadInput, match="was not written by glasswarp"):
        block.save(foreign)
    assert foreign.read_text() == "mine" and [one.name for one in tmp_path.iterdir()] == ["mine.stl"]
    block.save(foreign, force=True)
    block.save(foreign)
    assert foreign.stat().st_size > 4


def test_an_input_is_never_replaced(picture: pathlib.Path, tmp_path: pathlib.Path) -> None:
    own = tmp_path / "map.png"
    own.write_bytes(picture.read_bytes())
    with pytest.raises(gw.BadInput, match="map.png"):
        gw.design(own, nodes=33).save(own, force=True)
    assert own.read_bytes() == picture.read_bytes()


def test_a_block_travels_whole(block: gw.Block, tmp_path: pathlib.Path) -> None:
    far = pickle.loads(pickle.dumps(block))
    assert far == block and np.array_equal(far.heights_mm, block.heights_mm)
    assert far.summary == block.summary and far.predicted is not None and block.predicted is not None
    assert np.array_equal(far.predicted, block.predicted)
    for one, folder in ((block, tmp_path / "here"), (far, tmp_path / "there")):
        folder.mkdir()
        one.save(folder / "b.stl")
    assert (tmp_path / "here" / "b.stl").read_bytes() == (tmp_path / "there" / "b.stl").read_bytes()
    assert copy.deepcopy(block) == block and copy.copy(block) == block and hash(far) == hash(block)


def test_a_block_travels_to_where_its_picture_is_not(picture: pathlib.Path, tmp_path: pathlib.Path) -> None:
    own = tmp_path / "p.png"
    own.write_bytes(picture.read_bytes())
    kept = pickle.dumps(gw.design(own, nodes=33))
    own.unlink()
    pickle.loads(kept).save(tmp_path / "far.stl")
    assert (tmp_path / "far.p.png").read_bytes() == picture.read_bytes()


def test_a_bench_is_checked_once_and_does_not_change() -> None:
    bench = gw.Bench(distance="20cm", size_mm=np.float64(80), material="bk7")
    assert (bench.size_mm, bench.distance_mm, bench.ior, bench.mirror) == (80.0, 200.0, 1.5168, False)
    assert pickle.loads(pickle.dumps(bench)) == bench == copy.deepcopy(bench) and hash(bench) == hash(copy.copy(bench))
    assert bench.replace(distance_mm=300).distance_mm == 300 and bench.distance_mm == 200
    assert gw.Bench(distance="200mm") == gw.Bench(distance_mm=200)
    assert "distance='20cm'" in repr(bench)
    assert gw.Bench(mirror=True).ior is None
    with pytest.raises(AttributeError):
        bench.distance_mm = 3.0  # type: ignore[misc]


def test_keywords_go_before_the_bench_however_they_are_spelled(light: npt.NDArray[np.float64]) -> None:
    bench = gw.Bench(size_mm=60, distance="20cm")
    assert gw.design(light, bench, nodes=33, distance_mm=150).bench.distance_mm == 150


def test_defaults_are_those_of_the_library() -> None:
    assert (gw.Bench().size_mm, gw.Bench().distance_mm, gw.Bench().settings["material"]) == (100.0, 250.0, "pmma")


def test_progress_is_told_and_its_exception_ends_the_call(light: npt.NDArray[np.float64]) -> None:
    told: list[tuple[str, int, int]] = []
    gw.design(light, nodes=129, progress=lambda *news: told.append(news))
    assert told and all(0 <= done <= max(steps, done) for _, done, steps in told)

    class Enough(Exception):
        pass

    def stop(*_: object) -> None:
        raise Enough

    with pytest.raises(Enough):
        gw.design(light, nodes=257, progress=stop)
    # And the next one works.
    assert gw.design(light, nodes=33).size.nodes == (33, 25)


def test_bars_of_tqdm_can_be_asked_for(light: npt.NDArray[np.float64], capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("tqdm")
    gw.design(light, nodes=129, progress=True)
    assert "%|" in capsys.readouterr().err


def test_many_threads_may_call_at_once(light: npt.NDArray[np.float64], block: gw.Block) -> None:
    found: list[object] = []

    def work(k: int) -> None:
        own = gw.design(light, gw.Bench(size_mm=60, distance_mm=200, source_size="none"), nodes=81)
        found.append(np.array_equal(own.heights_mm, block.heights_mm))
        found.append(block.verify(photons=20_000, seed=1).relative_rms)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8 and len(set(found)) == 2 and True in found


def test_a_notebook_shows_the_block(block: gw.Block, tmp_path: pathlib.Path) -> None:
    shown = block._repr_html_()
    assert shown.startswith("<iframe") and "sandbox" in shown and 'srcdoc="&lt;!doctype html' in shown.lower()
    page = block.report(tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page and "<canvas" in page
    assert "Iterations" in block.summary._repr_html_() or "iterations" in block.summary._repr_html_()
    assert repr(block).startswith("<Block light: 60 x 45")
