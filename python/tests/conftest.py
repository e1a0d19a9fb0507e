"""What tests share: a picture, light that is a formula, and blocks of them."""

from __future__ import annotations

import pathlib

import numpy as np
import numpy.typing as npt
import pytest

import glasswarp as gw

SAMPLES = pathlib.Path(__file__).parents[2] / "samples"


@pytest.fixture(scope="session")
def picture() -> pathlib.Path:
    return SAMPLES / "camera" / "target.png"


@pytest.fixture(scope="session")
def light() -> npt.NDArray[np.float64]:
    """A spot left of the middle and a fainter one below: every flip of it is another picture."""
    y, x = np.mgrid[-1:1:48j, -1:1:64j]
    left = np.exp(-8 * ((x + 0.4) ** 2 + y**2))
    below = 0.5 * np.exp(-12 * (x**2 + (y - 0.6) ** 2))
    return np.asarray(left + below)


@pytest.fixture(scope="session")
def block(light: npt.NDArray[np.float64]) -> gw.Block:
    return gw.design(light, gw.Bench(size_mm=60, distance_mm=200, source_size="none"), nodes=81)
