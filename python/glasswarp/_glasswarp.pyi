"""The extension module: it computes, the package around it gives it its shape."""

import os
from collections.abc import Sequence
from typing import Callable, Optional, Union, final

import numpy as np
import numpy.typing as npt

_Light = npt.NDArray[np.float64]
_Told = tuple[list[tuple[str, int, int, str, list[tuple[float, float, float, int]], float]], list[str], list[str]]
_Listener = Callable[[str, int, int], object]
_State = tuple[
    list[str],
    os.PathLike[str],
    list[tuple[os.PathLike[str], bytes]],
    npt.NDArray[np.float64],
    list[_Light],
    _Told,
    float,
]

__all__ = ["VERSION", "Design", "ask", "bench", "design", "heights", "listed", "main", "restore", "tidy", "trace"]

VERSION: str

def main(words: Sequence[str]) -> int: ...
def tidy() -> None: ...
def ask(words: Sequence[str], progress: Optional[_Listener] = None) -> tuple[str, list[tuple[str, _Light]]]: ...
def listed() -> str: ...
def bench(words: Sequence[str]) -> str: ...
def design(
    words: Sequence[str],
    named: Union[str, os.PathLike[str], None],
    light: Optional[_Light] = None,
    progress: Optional[_Listener] = None,
) -> Design: ...
def restore(kept: _State) -> Design: ...
def heights(
    along_x: npt.NDArray[np.float64], along_y: npt.NDArray[np.float64], size_mm: tuple[float, float]
) -> npt.NDArray[np.float64]: ...
def trace(
    vertices: npt.NDArray[np.float64],
    triangles: npt.NDArray[np.uint32],
    rays: npt.NDArray[np.float64],
    ior: float,
    fresnel: bool,
) -> tuple[
    npt.NDArray[np.uint8],
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.float64],
    npt.NDArray[np.uint32],
]: ...

@final
class Design:
    def heights(self) -> npt.NDArray[np.float64]: ...
    def predicted(self) -> Optional[_Light]: ...
    def target(self) -> _Light: ...
    def described(self) -> str: ...
    def told(self) -> _Told: ...
    def warnings(self) -> list[str]: ...
    def seconds(self) -> float: ...
    def mesh(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]: ...
    def save(
        self, outputs: Sequence[Union[str, os.PathLike[str]]], cutter: Optional[str] = None, force: bool = False
    ) -> list[str]: ...
    def report(self, title: str) -> str: ...
    def state(self) -> _State: ...
