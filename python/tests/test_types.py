"""Types: the package and its tests by mypy, the stub by what the module is."""

from __future__ import annotations

import pathlib
import subprocess
import sys
from typing import Callable

import pytest

import glasswarp

FOLDER = pathlib.Path(__file__).parents[1]


@pytest.fixture
def run(tmp_path: pathlib.Path) -> Callable[..., None]:
    """Runs a module where nothing but what is installed can be found."""

    def run(*words: str) -> None:
        made = subprocess.run([sys.executable, "-m", *words], cwd=tmp_path, capture_output=True, text=True)
        assert made.returncode == 0, made.stdout + made.stderr

    return run


def test_the_package_and_its_tests_are_typed(run: Callable[..., None]) -> None:
    pytest.importorskip("mypy")
    run("mypy", "--strict", "-p", "glasswarp")
    run("mypy", "--strict", str(FOLDER / "tests"), str(FOLDER / "generate.py"))


def test_the_stub_says_what_the_module_is(run: Callable[..., None]) -> None:
    pytest.importorskip("mypy")
    run("mypy.stubtest", "glasswarp._glasswarp")


def test_the_wheel_says_that_it_is_typed() -> None:
    assert (pathlib.Path(glasswarp.__file__).parent / "py.typed").exists()
