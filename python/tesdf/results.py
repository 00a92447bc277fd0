"""Results of queries, `repair` and moved vertices, as named tuples."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .reports import RepairReport

if TYPE_CHECKING:
    from ._native import Asset, DeviceArray


class Answers(NamedTuple):
    """One row per point, in the mesh's unit. A point that is not finite has NaN and `NO_FACE`."""

    signed_distance: npt.NDArray[np.float64]
    """[N] distance to the nearest face, negative inside"""
    gradient: npt.NDArray[np.float64]
    """[N, 3] unit gradient of the signed distance; points outward"""
    closest_point: npt.NDArray[np.float64]
    """[N, 3] nearest point on the surface"""
    face: npt.NDArray[np.uint32]
    """[N] id of the nearest face in the source mesh"""


class ClosestPoints(NamedTuple):
    """The points of a mesh that are closest to given ones, in the mesh's unit. Of one point, `face`
    and `distance` are numbers. A point that is not finite has NaN and `NO_FACE`."""

    point: npt.NDArray[np.float64]
    """[..., 3] nearest point on the surface"""
    face: Any
    """[...] id of its face in the source mesh"""
    distance: Any
    """[...] distance to it, 0 or more"""


class DeviceAnswers(NamedTuple):
    """One row per point, in the mesh's unit, on the device of the points. A point that is not
    finite has NaN and `NO_FACE`."""

    signed_distance: DeviceArray
    """[N] float32, distance to the nearest face, negative inside"""
    gradient: DeviceArray
    """[N, 3] float32, unit gradient of the signed distance; points outward"""
    closest_point: DeviceArray
    """[N, 3] float32, nearest point on the surface"""
    face_row: DeviceArray
    """[N] uint32, row of the nearest face in `Asset.faces`; `Asset.face_ids` has its id in the
    source mesh"""


class RayHits(NamedTuple):
    """One row per ray, in the mesh's unit. A ray that meets no face has t = inf, NaN and
    `NO_FACE`."""

    t: npt.NDArray[np.float64]
    """[N] distance along the ray, in lengths of its direction"""
    point: npt.NDArray[np.float64]
    """[N, 3] point where the ray meets the face"""
    face: npt.NDArray[np.uint32]
    """[N] id of the face in the source mesh"""
    normal: npt.NDArray[np.float64]
    """[N, 3] outward unit normal of the face"""


class Repaired(NamedTuple):
    """A repaired mesh; `encode` accepts it directly."""

    vertices: npt.NDArray[np.float64]
    """[V, 3]"""
    faces: npt.NDArray[np.uint32]
    """[F, 3]"""
    report: RepairReport
    """all changes, and the remaining defects"""


class Moved(NamedTuple):
    """An asset after `Asset.move_vertices`, and what changed."""

    asset: Asset
    """the asset with moved vertices"""
    faces: int
    """number of faces with a vertex that moved"""
    tetrahedra: int
    """number of tetrahedra with a vertex that moved"""
    inverted: npt.NDArray[np.uint32]
    """tetrahedra that are now inverted or flat, ascending; their points may lie in several cells
    or in none"""


class Reencoded(NamedTuple):
    """An asset after `Asset.reencode_stale`, and the cells that were re-encoded."""

    asset: Asset
    """the asset with the new lists"""
    cells: int
    """number of cells with a list"""
    checked: int
    """number of cells that a moved face or vertex may affect"""
    stale: npt.NDArray[np.uint32]
    """cells with new lists, ascending"""
