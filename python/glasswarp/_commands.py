"""What is asked of a block or of its file: the commands of glasswarp as calls."""

from __future__ import annotations

import pathlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Optional, TypeVar, Union

import numpy as np
import numpy.typing as npt

from . import _records
from ._ask import Light, Path, ask
from ._block import PROGRAMS, Block
from ._errors import BadInput, GlasswarpError
from ._progress import Progress
from ._record import Record

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._keywords import (
        CheckOptions,
        CouponOptions,
        CrosscheckOptions,
        MergeOptions,
        MillOptions,
        PhotonsOptions,
        PreviewOptions,
        ProgramOptions,
        ReadyOptions,
        VerifyOptions,
    )

_Kind = TypeVar("_Kind", bound=Record)

#: A block, or a file that holds one.
AnyBlock = Union[Block, Path]


def _file(block: AnyBlock) -> Path:
    return block.filed() if isinstance(block, Block) else block


def _of(kind: type[_Kind], found: Record) -> _Kind:
    if not isinstance(found, kind):
        raise GlasswarpError(f"a record of {kind.__name__} was expected, and {type(found).__name__} was found")
    return found


def _shown(light: npt.NDArray[np.float64], white: float) -> npt.NDArray[np.uint8]:
    """Light as a picture: the transfer curve of sRGB."""
    level = np.clip(light / white, 0.0, 1.0)
    encoded = np.where(level <= 0.0031308, 12.92 * level, 1.055 * level ** (1 / 2.4) - 0.055)
    return np.rint(255.0 * encoded).astype(np.uint8)


@dataclass(frozen=True, eq=False)
class Found:
    """What the verifier found in a file: what its light draws, and how near to the picture."""

    #: Everything, as `glasswarp verify --json` tells it.
    record: _records.Verify
    #: Irradiance on the receiver, top row first, mean 1 over the window if no light is lost: in the light that there is.
    irradiance: Light
    #: The irradiance that was wanted, on the same pixels; None without a picture.
    target: Optional[Light]
    #: Red, green and blue of white light, shape (rows, columns, 3), linear, if `white` was asked for.
    white: Optional[npt.NDArray[np.float64]]

    @property
    def relative_rms(self) -> Optional[float]:
        """Relative RMS error of the light against the picture: in the light that there is, after the finish if one was
        designed for, or else in perfect light. None without a picture."""
        record = self.record
        view = record.imperfect or record.finished or record.judgement.picture
        return None if view is None else view.rel_rms

    @property
    def ssim(self) -> Optional[float]:
        """Structural similarity of the same light with the picture, at most 1."""
        record = self.record
        view = record.imperfect or record.finished or record.judgement.picture
        return None if view is None else view.ssim

    @property
    def flux(self) -> _records.Light:
        """Where the light goes, in parts of what fills the aperture; they add up to 1."""
        return self.record.judgement.light

    def __repr__(self) -> str:
        if self.relative_rms is None or self.ssim is None:
            return f"<Found in {self.record.file}: no picture to compare with>"
        return f"<Found in {self.record.file}: relative RMS {self.relative_rms:.4f}, SSIM {self.ssim:.4f}>"

    def _repr_html_(self) -> str:
        lights = [("Light", self.irradiance)] + ([("Picture", self.target)] if self.target is not None else [])
        white = float(lights[-1][1].max())
        figures = "".join(
            f"<figure style='display:inline-block;margin:4px'><img src='data:image/png;base64,{_png(_shown(light, white))}'"
            f" style='max-width:320px' alt='{name}'><figcaption>{name}</figcaption></figure>"
            for name, light in lights
        )
        return f"<div>{figures}</div><p>{repr(self)[1:-1]}</p>"


def _png(grey: npt.NDArray[np.uint8]) -> str:
    """A grey picture as PNG in base64."""
    import base64
    import struct
    import zlib

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    rows, columns = grey.shape
    lines = b"".join(b"\0" + row.tobytes() for row in grey)
    parts = [
        (b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, 0, 0, 0, 0)),
        (b"IDAT", zlib.compress(lines)),
        (b"IEND", b""),
    ]
    return base64.b64encode(b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*part) for part in parts)).decode()


def _without(options: Mapping[str, Any], *names: str, instead: str) -> None:
    for name in names:
        if options.get(name) not in (None, False):
            raise BadInput(f"{name} is asked by {instead}", setting=name, value=options[name])


def _is_program(block: AnyBlock) -> bool:
    return not isinstance(block, Block) and pathlib.PurePath(block).suffix.lower() in PROGRAMS


def verify(block: AnyBlock, *, progress: Progress = None, **options: Unpack[VerifyOptions]) -> Found:
    """Opens the file of a solid as a stranger would, traces light through it, and judges the picture.

    Args:
        block: A file (.stl, .obj, .glb, .gltf, .ply, .off, .3mf, .step, or a map of heights in .png or .exr) with its side
            file, or any closed solid with `ior` and `distance_mm`. A `Block` is written as STL, and that file is judged.
        progress: See `design`.
        options: Every option of `glasswarp verify`, with the same default: `target="portrait.png"`, `photons=...`.

    Raises:
        NotASolid: The mesh is not closed.
        FellShort: The error exceeds `max_error`, or photons and beams contradict each other.
        BadInput, FileError: See `design`.

    Methods and sources: docs/verification.md.
    """
    _without(options, "tally", "shard", instead="photons")
    _without(options, "sweep", "as_built", instead="sweep")
    if _is_program(block):
        raise BadInput(f"{block!s} is the program of a machine: program judges it", setting="block", value=block)
    if not isinstance(block, Block) and pathlib.PurePath(block).suffix.lower() == ".toml":
        raise BadInput(f'{block!s} is a stack of plates: command("verify", ...) judges it', setting="block", value=block)
    found, lights = ask("verify", [_file(block)], options, progress)
    colours = [lights[name] for name in ("red", "green", "blue") if name in lights]
    return Found(
        record=_of(_records.Verify, found),
        irradiance=lights["irradiance"],
        target=lights.get("target"),
        white=np.stack(colours, axis=-1) if colours else None,
    )


def program(file: Path, *, progress: Progress = None, **options: Unpack[ProgramOptions]) -> _records.Program:
    """Runs the program of a machine (.ngc, .nc, .tap, .gcode, .cnc) over its block in simulation, and judges what it cuts.

    See docs/programs.md.

    Raises:
        FellShort: The program must not be run, or the error exceeds `max_error`; `.result` holds what was found.
    """
    if not _is_program(file):
        raise BadInput(f"{file!s} is no program ({', '.join(PROGRAMS)})", setting="file", value=file)
    return _of(_records.Program, ask("verify", [file], options, progress)[0])


def photons(
    block: AnyBlock, tally: Path, *, progress: Progress = None, **options: Unpack[PhotonsOptions]
) -> _records.Tally:
    """Traces photons only, and writes their exact sums.

    Args:
        block: A block or its file.
        tally: Where to (OpenEXR).
        options: Of `glasswarp verify`: `photons`, `seed`, `replicates`, `shard="2/8"` for a part of the run, ...

    `merge` adds parts up to what one run gives, byte by byte.
    """
    given = {**options, "tally": tally}
    return _of(_records.Tally, ask("verify", [_file(block)], given, progress)[0])


def merge(*tallies: Path, progress: Progress = None, **options: Unpack[MergeOptions]) -> _records.Tally:
    """Adds up the tallies of a run's parts; `tally` writes the sum, `output` its light."""
    return _of(_records.Tally, ask("merge", tallies, options, progress)[0])


@dataclass(frozen=True, eq=False)
class Swept:
    """A range of benches, and what is seen on each."""

    #: Everything, as `glasswarp verify --sweep --json` tells it.
    record: _records.Sweep
    #: The light at every place, by its view (displaced, plane, smooth, facets): shape (places, rows, columns).
    lights: Mapping[str, npt.NDArray[np.float64]]

    def column(self, name: str) -> npt.NDArray[np.float64]:
        """A figure of every place, by its name in `SweepPoint`; not a number where it is not known."""
        return np.array([np.nan if getattr(one, name) is None else getattr(one, name) for one in self.record.points])

    def __repr__(self) -> str:
        return f"<Swept {self.record.swept}: {len(self.record.points)} places>"


def sweep(
    block: AnyBlock,
    what: str,
    start: float,
    stop: float,
    *,
    steps: Optional[int] = None,
    as_built: bool = False,
    progress: Progress = None,
    **options: Unpack[VerifyOptions],
) -> Swept:
    """Designs a block anew along a range, and looks at every one.

    Args:
        block: A block or its file.
        what: distance, size, thickness (mm), index or nodes.
        start, stop: From where to where.
        steps: Number of places, in equal ratios.
        as_built: Does not design anew, but looks at this very block from another distance or through another index.
        options: Of `glasswarp verify`, as `output="curves.png"`.

    Places that cannot be are warned of and left out. See docs/plane-assumption.md.
    """
    given: dict[str, Any] = {**options, "sweep": f"{what}={start!r}..{stop!r}", "steps": steps, "as_built": as_built}
    found, lights = ask("verify", [_file(block)], given, progress)
    views: dict[str, list[Light]] = {}
    for name, light in lights.items():
        views.setdefault(name.rsplit(" ", 1)[1], []).append(light)
    same = {name: np.stack(seen) for name, seen in views.items() if len({one.shape for one in seen}) == 1}
    return Swept(record=_of(_records.Sweep, found), lights=same)


def preview(picture: Path, *, progress: Progress = None, **options: Unpack[PreviewOptions]) -> _records.Preview:
    """Looks at what a picture would become, in a second or two: a coarse draft, written as a page to turn it on.

    Args:
        picture: A picture, or a design file.
        options: Settings, and `output` (.html or .png) [default: the picture's name with .preview.html, in the working
            folder].
    """
    return _of(_records.Preview, ask("preview", [picture], options, progress)[0])


def check(block: AnyBlock, *, progress: Progress = None, **options: Unpack[CheckOptions]) -> _records.Check:
    """Says whether a block can be made, and with `tolerance=True` what tolerances do to its picture.

    A block that cannot be made is an answer, and no exception: see `.makeable` and `.verdict`. See docs/fabrication.md.
    """
    return _of(_records.Check, ask("check", [_file(block)], options, progress, answers=True)[0])


def mill(block: AnyBlock, *, progress: Progress = None, **options: Unpack[MillOptions]) -> _records.Mill:
    """Mills and polishes a block in simulation, and judges every step; `output="portrait.ngc"` writes the program.

    Raises:
        FellShort: The error exceeds `max_error`, or no cutter keeps to `want_error`.

    See docs/fabrication.md.
    """
    return _of(_records.Mill, ask("mill", [_file(block)], options, progress)[0])


def ready(block: AnyBlock, *, progress: Progress = None, **options: Unpack[ReadyOptions]) -> _records.Ready:
    """Asks all that matters before a slab is paid for, and writes a sheet to print.

    The sheet is `output`, or lies beside the file; of a `Block` it is kept only if `output` names it. That it will not
    work is an answer, and no exception: see `.verdict`. See docs/verdict.md.
    """
    return _of(_records.Ready, ask("ready", [_file(block)], options, progress, answers=True)[0])


def coupon(*, progress: Progress = None, **options: Unpack[CouponOptions]) -> _records.Coupon:
    """Makes a test coupon that tells polish, index, step-over and direction of a bench, in the working folder or where
    `output` says. See docs/coupon.md."""
    return _of(_records.Coupon, ask("coupon", [], options, progress)[0])


def crosscheck(block: AnyBlock, *, progress: Progress = None, **options: Unpack[CrosscheckOptions]) -> _records.Crosscheck:
    """Shows a block to an independent renderer, `with_="blender"` for one, and compares. See docs/crosscheck.md."""
    return _of(_records.Crosscheck, ask("crosscheck", [_file(block)], options, progress)[0])


def materials() -> tuple[_records.Material, ...]:
    """The materials known by name, with their refractive indices and where these are from."""
    return _of(_records.Materials, ask("materials", [], {})[0]).materials


def presets() -> tuple[_records.Preset, ...]:
    """Common set-ups to start from; `preset="..."` takes one."""
    return _of(_records.Presets, ask("presets", [], {})[0]).presets


def command(name: str, *files: Path, progress: Progress = None, **options: Any) -> Record:
    """Runs any command as it is run in a shell, with its options as keywords, and returns its record.

    >>> command("completions", "bash").text.splitlines()[0]
    '_glasswarp() {'

    Args:
        name: design, preview, verify, merge, check, mill, ready, coupon, crosscheck, materials, presets, completions, man.
        files: What stands without a flag there. A `Block` is written first, as in `verify`.

    Raises:
        FellShort: Where the command's exit code would be 3; `.result` holds what was found.
    """
    from . import _listed

    if name not in _listed.commands():
        raise BadInput(f"there is no command {name}; there are {', '.join(_listed.commands())}", setting="name", value=name)
    return ask(name, [_file(one) for one in files], options, progress)[0]
