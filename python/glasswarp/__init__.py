"""Turns a picture into a block of glass whose light draws that picture, and traces light through the file.

>>> import glasswarp as gw
>>> block = gw.design("portrait.png", gw.Bench(size_mm=100, distance_mm=250))   # doctest: +SKIP
>>> block.save("portrait.step", "portrait.stl")                                # doctest: +SKIP
>>> gw.verify("portrait.stl").relative_rms                                     # doctest: +SKIP

Frame: millimetres, right-handed; light travels +z, the entry face is planar at the least z, the exit face is z = h(x, y)
with its mean at 0, the receiver is the plane z = distance. Grids of the block have rows along +y and columns along +x;
pictures and irradiance have their top row first, as seen on the receiver from the block's side: left is +x, top is +y.
Irradiance is linear, its mean 1 over the picture.

Everything may be called from several threads. Calls leave the interpreter free; those that work on files take turns, each on
all cores. Everything that is returned can be pickled and copied.
"""

import atexit as _atexit

from . import _glasswarp
from ._batch import Task, batch, grid, merge_shards, photon_shards, tolerance_grid
from ._bench import Bench
from ._block import Block, Level, Summary, design
from ._commands import (
    Found,
    Swept,
    check,
    command,
    coupon,
    crosscheck,
    materials,
    merge,
    mill,
    photons,
    presets,
    preview,
    program,
    ready,
    sweep,
    verify,
)
from ._errors import (
    BadInput,
    FellShort,
    FileError,
    GlasswarpError,
    GlasswarpWarning,
    NotASolid,
    UnknownSetting,
)
from ._glasswarp import VERSION as __version__
from ._rays import LEFT, LOST, MISSED, TRAPPED, Rays, normals_to_heights, trace

_atexit.register(_glasswarp.tidy)

__all__ = [
    "LEFT",
    "LOST",
    "MISSED",
    "TRAPPED",
    "BadInput",
    "Bench",
    "Block",
    "FellShort",
    "FileError",
    "Found",
    "GlasswarpError",
    "GlasswarpWarning",
    "Level",
    "NotASolid",
    "Rays",
    "Summary",
    "Swept",
    "Task",
    "UnknownSetting",
    "__version__",
    "batch",
    "check",
    "command",
    "coupon",
    "crosscheck",
    "design",
    "grid",
    "materials",
    "merge",
    "merge_shards",
    "mill",
    "normals_to_heights",
    "photon_shards",
    "photons",
    "presets",
    "preview",
    "program",
    "ready",
    "sweep",
    "tolerance_grid",
    "trace",
    "verify",
]
