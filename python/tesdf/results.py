"""What queries, `repair` and moved vertices give: tuples with names."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from .reports import RepairReport

if TYPE_CHECKING:
    from ._native import Asset


class Answers(NamedTuple):
    """One row for each point, in the mesh's unit. A point that has no answer has NaN and `NO_FACE`."""

    signed_distance: npt.NDArray[np.float64]
    """[N] distance to the nearest face, negative inside"""
    gradient: npt.NDArray[np.float64]
    """[N, 3] unit gradient of the signed distance; it points outward"""
    closest_point: npt.NDArray[np.float64]
    """[N, 3] the nearest point of the surface"""
    face: npt.NDArray[np.uint32]
    """[N] the nearest face, by its id in the source mesh"""


class RayHits(NamedTuple):
    """One row for each ray, in the mesh's unit. A ray that meets nothing has t = inf, NaN and `NO_FACE`."""

    t: npt.NDArray[np.float64]
    """[N] distance along the ray, in lengths of its direction"""
    point: npt.NDArray[np.float64]
    """[N, 3] the point met"""
    face: npt.NDArray[np.uint32]
    """[N] the face met, by its id in the source mesh"""
    normal: npt.NDArray[np.float64]
    """[N, 3] outward unit normal of that face"""


class Repaired(NamedTuple):
    """A mesh after `repair`; `encode` takes it as it is."""

    vertices: npt.NDArray[np.float64]
    """[V, 3]"""
    faces: npt.NDArray[np.uint32]
    """[F, 3]"""
    report: RepairReport
    """every change, and what is left to be done"""


class Moved(NamedTuple):
    """An asset after `Asset.move_vertices`, and what has changed."""

    asset: Asset
    """the asset as it is now"""
    faces: int
    """number of faces with a vertex that moved"""
    tetrahedra: int
    """number of tetrahedra with a vertex that moved"""
    inverted: npt.NDArray[np.uint32]
    """those of them that are now inside out or flat, ascending: points of them may be found in several cells or in none"""


class Reencoded(NamedTuple):
    """An asset after `Asset.reencode_stale`, and what was done."""

    asset: Asset
    """the asset with the new lists"""
    cells: int
    """number of cells with a list"""
    checked: int
    """number of those that something that moved may matter to"""
    stale: npt.NDArray[np.uint32]
    """those whose list was made anew, ascending"""
