"""Rays through any closed solid, and heights from normals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Optional

import numpy as np
import numpy.typing as npt

from . import _glasswarp
from ._bench import Bench
from ._errors import BadInput

if TYPE_CHECKING:
    from ._keywords import Settings

#: How a ray ends.
LEFT, MISSED, TRAPPED, LOST = range(4)


@dataclass(frozen=True, eq=False)
class Rays:
    """Where rays leave a solid."""

    #: How every ray ends, shape (n,): LEFT the solid for good, MISSED it, TRAPPED in it after 24 interfaces, or LOST (no
    #: ray of finite numbers is, in a closed solid).
    how: npt.NDArray[np.uint8]
    #: The last interface that it passed, or where it began, mm, shape (n, 3).
    points: npt.NDArray[np.float64]
    #: Where it goes from there, of length 1, shape (n, 3).
    directions: npt.NDArray[np.float64]
    #: The part of its power that gets there, shape (n,): 1 without Fresnel's equations.
    transmittance: npt.NDArray[np.float64]
    #: Interfaces that it met, shape (n,).
    interfaces: npt.NDArray[np.uint32]

    def at_z(self, z_mm: float) -> npt.NDArray[np.float64]:
        """Where they meet the plane of this z, shape (n, 2), mm; not a number where they do not."""
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (z_mm - self.points[:, 2]) / self.directions[:, 2]
            landed = self.points[:, :2] + along[:, None] * self.directions[:, :2]
        landed[~((along >= 0.0) & (self.how <= MISSED))] = np.nan
        return landed


def _matrix(what: str, array: npt.ArrayLike, columns: int) -> npt.NDArray[np.float64]:
    found = np.ascontiguousarray(array, dtype=np.float64)
    if found.ndim != 2 or found.shape[1] != columns:
        raise BadInput(f"{what} have the shape (n, {columns}), not {found.shape}", setting=what, value=found.shape)
    return found


def trace(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    rays: npt.ArrayLike,
    *,
    ior: Optional[float] = None,
    material: Optional[str] = None,
    fresnel: bool = False,
) -> Rays:
    """Follows rays through any closed solid, refracted wherever that is possible and else reflected.

    Args:
        vertices: Shape (n, 3), in mm or any other unit of length.
        faces: Triangles as numbers of vertices, shape (m, 3), counter-clockwise as seen from outside.
        rays: Origins and directions, shape (k, 6). Directions may have any length. A ray may begin in the glass.
        ior: Refractive index, or `material` by its name; without either, that of a `Bench` of which nothing is said.
        fresnel: Counts what is reflected at every interface (unpolarised).

    Arrays of doubles in rows (and of uint32 for faces) are not copied. All cores work, and the interpreter is free.

    Raises:
        NotASolid: A mesh that is not closed, or does not face outwards everywhere.
        BadInput: Another shape, an index out of range.

    The test is that of Woop, Benthin and Wald (Watertight Ray/Triangle Intersection, JCGT 2013), in double precision: no
    ray is lost between two triangles.
    """
    triangles = np.asarray(faces)
    if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "ui":
        raise BadInput(
            f"faces are whole numbers of the shape (m, 3), not {triangles.dtype} of {triangles.shape}",
            setting="faces",
            value=triangles.shape,
        )
    if triangles.size and (triangles.min() < 0 or triangles.max() >= 2**32):
        raise BadInput("faces are numbers of vertices, from 0 on", setting="faces", value=int(triangles.min()))
    said: Settings = {}
    if ior is not None:
        said["ior"] = ior
    if material is not None:
        said["material"] = material
    return Rays(
        *_glasswarp.trace(
            _matrix("vertices", vertices, 3),
            np.ascontiguousarray(triangles, dtype=np.uint32),
            _matrix("rays", rays, 6),
            float(Bench(**said).ior or 0.0),
            fresnel,
        )
    )


def normals_to_heights(
    nx: npt.ArrayLike,
    ny: npt.ArrayLike,
    nz: Optional[npt.ArrayLike] = None,
    *,
    size_mm: Optional[tuple[float, float]] = None,
) -> npt.NDArray[np.float64]:
    """The heights of a surface whose normals are known at nodes, by least squares over the edges of the grid.

    Args:
        nx, ny: Components of the normals along +x and +y, shape (rows, columns), rows along +y and columns along +x.
        nz: Their components along +z; without it normals are taken to be of length 1 and to face +z.
        size_mm: Width and height of the face, from its first to its last node; without it nodes are 1 mm apart.

    Returns:
        Heights, of the shape of `nx` and the mean 0, mm.

    Raises:
        BadInput: Shapes that differ, fewer than 4 x 4 nodes, a normal that does not face +z.

    Fourth order in the spacing of the nodes; section 2.3 of the paper, with its system (5) solved by cosine transforms.
    """
    along_x, along_y = (np.asarray(one, dtype=np.float64) for one in (nx, ny))
    if along_x.ndim != 2 or along_x.shape != along_y.shape:
        shapes = f"{along_x.shape} and {along_y.shape}"
        raise BadInput(f"nx and ny are arrays of one shape with two dimensions, not {shapes}", setting="nx", value=shapes)
    upwards = np.sqrt(np.maximum(1.0 - along_x**2 - along_y**2, 0.0)) if nz is None else np.asarray(nz, dtype=np.float64)
    if upwards.shape != along_x.shape:
        raise BadInput(f"nz has the shape {upwards.shape}, not {along_x.shape}", setting="nz", value=upwards.shape)
    wrong = ~((upwards > 0.0) & np.isfinite(along_x) & np.isfinite(along_y) & np.isfinite(upwards))
    if wrong.any():
        row, column = np.argwhere(wrong)[0]
        normal = (float(along_x[row, column]), float(along_y[row, column]), float(upwards[row, column]))
        raise BadInput(
            f"normals face +z and are finite; row {row}, column {column} holds {normal}", setting="nx", value=normal
        )
    rows, columns = along_x.shape
    size = (float(columns - 1), float(rows - 1)) if size_mm is None else (float(size_mm[0]), float(size_mm[1]))
    return _glasswarp.heights(-along_x / upwards, -along_y / upwards, size)
