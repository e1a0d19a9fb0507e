"""Designing a block, and the block."""

from __future__ import annotations

import html
import json
import os
import pathlib
import shutil
import tempfile
import threading
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _glasswarp, _listed, _records
from ._ask import Light, Path, warn
from ._bench import Bench, merged
from ._errors import BadInput, GlasswarpError, in_keywords, with_given
from ._progress import Progress, Told
from ._record import Record, of_dict

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._commands import Found
    from ._keywords import DesignOptions, VerifyOptions


@dataclass(frozen=True)
class Level(Record):
    """What the solver did on one grid."""

    #: What was done.
    stage: str
    #: Nodes along x and y.
    nodes: tuple[int, ...]
    #: Why it ended: converged, iteration limit, no further progress, or cancelled.
    ended: str
    #: The objective after every iteration, or the norm of the residual for a solver of equations.
    objective: tuple[float, ...]
    #: Wall time, seconds.
    seconds: float


@dataclass(frozen=True)
class Summary(Record):
    """What the solver did."""

    #: The solver's name.
    solver: str
    #: Iterations in all.
    iterations: int
    #: Wall time, seconds.
    seconds: float
    #: What was chosen automatically.
    notes: tuple[str, ...]
    #: What one should know: a level that has not converged, a fold, where the solution is weakest.
    warnings: tuple[str, ...]
    #: Every grid, in order.
    levels: tuple[Level, ...]


class Block:
    """A block that was designed. It does not change, may be used by many threads, pickled and copied.

    `design` makes one. In a notebook it shows its picture, its figures, and a model that turns.
    """

    __slots__ = ("__weakref__", "_described", "_folder", "_lock", "_made")

    def __init__(self, made: _glasswarp.Design) -> None:
        self._made = made
        self._described: Mapping[str, Any] = json.loads(made.described())
        self._lock = threading.Lock()
        self._folder: Optional[str] = None

    @property
    def name(self) -> str:
        """The name of its picture, without the extension."""
        return pathlib.PurePath(self._described["picture"]).stem

    @property
    def heights_mm(self) -> npt.NDArray[np.float64]:
        """Heights of the exit face at its nodes, mm, of mean 0: `heights_mm[j, i]`, j along +y, i along +x.

        Nodes span the face from edge to edge. The array belongs to the block (nothing is copied) and is read-only.
        """
        return self._made.heights()

    @property
    def predicted(self) -> Optional[Light]:
        """Irradiance on the receiver as the solver sees it, top row first, mean 1 if no light is lost; None from
        solvers that do not look. `verify` traces the file, and is the one to believe."""
        return self._made.predicted()

    @property
    def target(self) -> Light:
        """The irradiance that is wanted, top row first, mean 1."""
        return self._made.target()

    @property
    def size(self) -> _records.Block:
        """Its size, relief and nodes."""
        return of_dict(_records.Block, self._described["block"])

    @property
    def bench(self) -> _records.Bench:
        """Where it stands."""
        return of_dict(_records.Bench, self._described["bench"])

    @property
    def settings(self) -> dict[str, Any]:
        """The settings by their names in design files, with every default that must not change when it is made again."""
        return {name: value for name, value in self._described["settings"].items() if value is not None}

    @property
    def summary(self) -> Summary:
        """What the solver did."""
        levels, notes, warnings = self._made.told()
        return Summary(
            solver=self._described["solver"],
            iterations=sum(len(level[4]) for level in levels),
            seconds=self._made.seconds(),
            notes=tuple(map(in_keywords, notes)),
            warnings=tuple(map(in_keywords, warnings)),
            levels=tuple(
                Level(stage, (nx, ny), ended, tuple(one[0] for one in iterations), seconds)
                for stage, nx, ny, ended, iterations, seconds in levels
            ),
        )

    def mesh(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32]]:
        """The closed solid as files have it: vertices (n, 3), mm, in the frame of the bench, and triangles (m, 3), which
        face outwards. `trace` takes both."""
        return self._made.mesh()

    def save(self, *files: Path, cutter: Optional[str] = None, force: bool = False) -> list[str]:
        """Writes files, and their side file (.toml) beside them.

        Args:
            files: Where to. The extension is the format: .stl, .step, .3mf, .obj, .glb, .ply; or a map of heights for
                a router, .png (16-bit) or .exr (32-bit, mm).
            cutter: Offsets maps of heights for it, as "ball:d6mm": they then tell where its tip goes.
            force: Replaces files that glasswarp did not write, or that were changed since.

        Returns:
            What there is to say of the files.

        Raises:
            BadInput: An extension that is none, a file of somebody's own, one that would replace an input, two that are one.
            FileError: A folder that is missing, a full disk. Every file is whole or not there.
        """
        for file in files:
            if pathlib.PurePath(file).suffix.lower() in PROGRAMS:
                raise BadInput(
                    f"{os.fspath(file)} is the program of a machine: mill(block, output=...) writes it",
                    setting="files",
                    value=file,
                )
        return [in_keywords(text) for text in self._made.save(list(files), cutter, force)]

    def filed(self) -> str:
        """An STL of the block with its side file, which lie in a temporary folder as long as the block lives."""
        with self._lock:
            if self._folder is None:
                folder = tempfile.mkdtemp(prefix="glasswarp-")
                weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
                self._made.save([os.path.join(folder, self.name + ".stl")])
                self._folder = folder
            return os.path.join(self._folder, self.name + ".stl")

    def verify(self, *, progress: Progress = None, **options: Unpack[VerifyOptions]) -> Found:
        """Writes the block as STL, traces light through that file, and judges the picture: see `verify`."""
        from ._commands import verify

        return verify(self, progress=progress, **options)

    def report(self, file: Optional[Path] = None) -> str:
        """The report, a page of HTML that asks for nothing else: pictures, figures, drawings, and the model that turns.
        It says what the solver expects; `command("design", ..., report=...)` writes one with what the verifier found.

        Args:
            file: Where to write it, if anywhere. What stands there is replaced.
        """
        page = self._made.report(self.name)
        if file is not None:
            pathlib.Path(file).write_text(page, encoding="utf-8")
        return page

    def _repr_html_(self) -> str:
        page = html.escape(self.report(), quote=True)
        return (
            f'<iframe title="{html.escape(self.name)}" sandbox="allow-scripts" srcdoc="{page}"'
            ' style="width: 100%; height: 640px; border: 1px solid #ccc"></iframe>'
        )

    def __repr__(self) -> str:
        size = self.size
        nx, ny = size.nodes
        return (
            f"<Block {self.name}: {size.width_mm:g} x {size.height_mm:g} x {size.thickness_mm:g} mm, {nx} x {ny} nodes,"
            f" relief {size.relief_mm:.3f} mm>"
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Block):
            return NotImplemented
        return self._described == other._described and np.array_equal(self.heights_mm, other.heights_mm)

    def __hash__(self) -> int:
        return hash(json.dumps(self._described, sort_keys=True))

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (self._made.state(),))

    def __copy__(self) -> Block:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Block:
        # Nothing of it can change.
        return self


#: Extensions of programs of machines.
PROGRAMS = (".ngc", ".nc", ".tap", ".gcode", ".cnc")


def _restored(state: Any) -> Block:
    return Block(_glasswarp.restore(state))


def light_of(picture: Union[npt.ArrayLike, Sequence[Sequence[float]]]) -> Light:
    """A two-dimensional array of light, its greatest value 1.

    Raises:
        BadInput: Another shape, a value that is negative or not finite, or no light at all.
    """
    light = np.asarray(picture)
    if light.ndim != 2 or min(light.shape) < 2:
        raise BadInput(
            f"an array of light has two dimensions of at least 2, rows from the top and columns from the left; this one has the shape {light.shape}",
            setting="picture",
            value=light.shape,
        )
    if light.dtype.kind not in "buif":
        raise BadInput(f"an array of light holds real numbers, not {light.dtype}", setting="picture", value=light.dtype)
    light = np.ascontiguousarray(light, dtype=np.float64)
    wrong = ~(np.isfinite(light) & (light >= 0.0))
    if wrong.any():
        row, column = np.argwhere(wrong)[0]
        raise BadInput(
            f"light is finite and not negative; row {row}, column {column} holds {light[row, column]}",
            setting="picture",
            value=float(light[row, column]),
        )
    brightest = light.max()
    if brightest == 0.0:
        raise BadInput("there is no light in this array: all of it is 0", setting="picture", value=0.0)
    return light if brightest == 1.0 else light / brightest


def design(
    picture: Union[Path, npt.ArrayLike],
    bench: Optional[Bench] = None,
    *,
    progress: Progress = None,
    **settings: Unpack[DesignOptions],
) -> Block:
    """Designs a block of glass whose light draws a picture.

    >>> import numpy as np
    >>> y, x = np.mgrid[-1:1:64j, -1:1:64j]
    >>> block = design(np.exp(-4 * (x**2 + y**2)), Bench(size_mm=40), nodes=65)
    >>> block.heights_mm.shape
    (65, 65)

    Args:
        picture: A picture file (PNG, JPEG, TIFF, WebP, BMP, GIF, PNM, OpenEXR, SVG), a design file (.toml), or the light
            itself: an array of shape (rows, columns), top row first, of linear irradiance in any unit. Its greatest value
            counts as white, of which `offset` is a part. Arrays are kept in single precision, as OpenEXR is.
        bench: Settings to go by; keywords go before them.
        progress: Called with stage, steps done and steps in all; None shows a bar in notebooks that have tqdm.
        settings: Every setting of `glasswarp design`, by keyword and with the same default.

    Returns:
        The block. Nothing is written: `Block.save` does that, and `verify` traces light through the file.

    Raises:
        UnknownSetting: A keyword that is no setting.
        BadInput: A value that is none, settings that exclude each other, a picture that physics forbids on this bench, or
            more memory than is free.
        FileError: A file that cannot be read.
        KeyboardInterrupt: Ctrl-C ends the solver at its next iteration.

    The solver is described, with its sources, in docs/transport.md.
    """
    given = merged(bench._given if bench is not None else {}, settings)
    words = _listed.in_words(_listed.flags(_listed.settings(), given))
    named = picture if isinstance(picture, (str, os.PathLike)) else None
    light = None if named is not None else light_of(picture)  # type: ignore[arg-type]
    try:
        with Told(progress) as listener:
            made = _glasswarp.design(words, named, light, listener)
    except GlasswarpError as error:
        raise with_given(error, given) from None
    warn(made.warnings(), 2)
    return Block(made)
