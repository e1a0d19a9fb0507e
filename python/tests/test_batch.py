"""Many calls, by executors that exist, some of which lose their workers."""

from __future__ import annotations

import concurrent.futures
import multiprocessing
import os
import pathlib
import signal
import time
import typing

import numpy as np
import numpy.typing as npt
import pytest

import glasswarp as gw


def designs(light: npt.NDArray[np.float64]) -> list[gw.Task[gw.Block]]:
    return gw.grid(gw.design, light, nodes=33, distance_mm=[150, 200, 300], source_size="none")


def test_tasks_are_done_in_order_here(light: npt.NDArray[np.float64]) -> None:
    told: list[tuple[str, int, int]] = []
    found = gw.batch(designs(light), progress=lambda *news: told.append(news))
    assert [block.bench.distance_mm for block in found] == [150, 200, 300]
    assert told == [("batch", done, 3) for done in range(4)]


def test_a_process_pool_gives_the_same_bits(light: npt.NDArray[np.float64]) -> None:
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert gw.batch(designs(light), pool) == gw.batch(designs(light))


def test_a_forked_process_has_threads_of_its_own(light: npt.NDArray[np.float64]) -> None:
    here = gw.batch(designs(light))
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert gw.batch(designs(light), pool) == here


def test_photons_add_up_whoever_traces_them(block: gw.Block, tmp_path: pathlib.Path) -> None:
    options: dict[str, typing.Any] = {"photons": 64_000, "seed": 3, "replicates": 16}
    one = gw.photons(block, tmp_path / "one.exr", **options)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        parts = gw.batch(gw.photon_shards(block, 5, **options), pool)
    merged = gw.merge_shards(parts, tally=tmp_path / "merged.exr")
    assert merged.rel_rms is None and merged.photons == one.photons
    assert (tmp_path / "merged.exr").read_bytes() == (tmp_path / "one.exr").read_bytes()


def test_tolerances_are_a_grid(block: gw.Block) -> None:
    tasks = gw.tolerance_grid(block, tilt_off_deg=[0.5, 2.0], pixels=16)
    found = gw.batch(tasks)
    assert len(found) == 2 and all(one.tolerances is not None for one in found) and found[0] != found[1]


def dies_once(mark: str) -> int:
    """Takes its worker with it, the first time."""
    try:
        pathlib.Path(mark).touch(exist_ok=False)
    except FileExistsError:
        return 7
    os.kill(os.getpid(), signal.SIGKILL)
    return 0


@pytest.mark.skipif(os.name != "posix", reason="signals are those of POSIX")
def test_what_a_broken_pool_has_lost_is_done_here(light: npt.NDArray[np.float64], tmp_path: pathlib.Path) -> None:
    tasks: list[gw.Task[typing.Any]] = [gw.Task(dies_once, (str(tmp_path / "mark"),)), *designs(light)]
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        with pytest.warns(gw.GlasswarpWarning, match="it is done here"):
            found = gw.batch(tasks, pool, retries=1)
    assert found == [7, *gw.batch(designs(light))]


def test_what_a_task_raises_is_raised(light: npt.NDArray[np.float64]) -> None:
    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        with pytest.raises(gw.BadInput) as raised:
            gw.batch([gw.Task(gw.design, (light,), {"nodes": 3})], pool)
    assert raised.value.setting == "nodes"


@pytest.mark.filterwarnings("default")
def test_dask_does_what_a_killed_worker_has_lost_again(block: gw.Block, tmp_path: pathlib.Path) -> None:
    distributed = pytest.importorskip("distributed")
    options: dict[str, typing.Any] = {"photons": 4_000_000, "seed": 9, "replicates": 32}
    gw.photons(block, tmp_path / "one.exr", **options)
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        pids = client.run(os.getpid)
        assert len(set(pids.values())) == 2
        killed: list[int] = []

        def kill_one(_: str, done: int, tasks: int) -> None:
            if done >= 2 and not killed:
                killed.append(next(iter(pids.values())))
                os.kill(killed[0], signal.SIGKILL)

        parts = gw.batch(gw.photon_shards(block, 16, **options), client, progress=kill_one)
        assert killed
        # The nanny starts another worker in its place.
        deadline = time.monotonic() + 60
        while killed[0] in client.run(os.getpid).values() and time.monotonic() < deadline:
            time.sleep(0.1)
    gw.merge_shards(parts, tally=tmp_path / "merged.exr")
    assert (tmp_path / "merged.exr").read_bytes() == (tmp_path / "one.exr").read_bytes()


def test_ray_runs_the_same(light: npt.NDArray[np.float64]) -> None:
    pool_of = pytest.importorskip("ray.util.multiprocessing")
    with pool_of.Pool(2) as pool:
        assert gw.batch(designs(light), pool) == gw.batch(designs(light))
