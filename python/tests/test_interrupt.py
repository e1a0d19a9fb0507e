"""Ctrl-C."""

from __future__ import annotations

import os
import pathlib
import signal
import subprocess
import sys
import time

import pytest

import glasswarp as gw

WORK = """
import glasswarp as gw, numpy as np, sys, time
y, x = np.mgrid[-1:1:512j, -1:1:512j]
light = np.exp(-8 * (x**2 + y**2)) + 0.2 * np.cos(9 * x) ** 2
try:
    print("begins", flush=True)
    {call}
except KeyboardInterrupt:
    print("interrupted", flush=True)
    print(gw.design(light, nodes=17).size.nodes)
"""

CALLS = {
    "design": 'gw.design(light, nodes=4097, quality="fine", ignore_memory=True)',
    "files": 'gw.verify("b.stl", photons=2_000_000_000, output="light.exr")',
    "callback": "gw.design(light, nodes=4097, ignore_memory=True, progress=lambda *_: None)",
}


@pytest.mark.skipif(os.name != "posix", reason="signals are those of POSIX")
@pytest.mark.parametrize("call", CALLS)
def test_it_ends_a_call_and_leaves_nothing(call: str, block: gw.Block, tmp_path: pathlib.Path) -> None:
    block.save(tmp_path / "b.stl")
    before = sorted(tmp_path.iterdir())
    words = [sys.executable, "-c", WORK.format(call=CALLS[call])]
    with subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "begins\n"
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        # Whole, each of these takes minutes.
        said, _ = process.communicate(timeout=120)
    assert said == "interrupted\n(17, 17)\n" and process.returncode == 0
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.skipif(os.name != "posix", reason="signals are those of POSIX")
def test_the_command_ends_as_the_program_does(picture: pathlib.Path, tmp_path: pathlib.Path) -> None:
    words = [sys.executable, "-m", "glasswarp", "design", str(picture), "--nodes=4097", "--ignore-memory", "-o", "b.stl"]
    with subprocess.Popen(words, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
        time.sleep(2.0)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=120)
    assert process.returncode == 130 and "nothing half-written was left" in said
    assert list(tmp_path.iterdir()) == []
