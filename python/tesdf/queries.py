"""Signed distances, insides and closest points of meshes, each in one call."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from . import _native
from .bodies import Mesh
from .results import ClosestPoints


def _rows(points: npt.ArrayLike) -> tuple[npt.NDArray[Any], tuple[int, ...]]:
    """Points as rows, and the shape of answers that are numbers."""
    array = np.asarray(points)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"points: an array of shape {array.shape}; expected shape (..., 3)")
    return array.reshape(-1, 3), array.shape[:-1]


def signed_distance(mesh: Mesh, points: npt.ArrayLike, *, precision: Literal["f64", "f32"] = "f64") -> Any:
    """The signed distances [...] of points [..., 3] to a mesh, negative inside; of one point [3] a number.

    mesh: an `Asset`, a path (a mesh file or .tesdf), (vertices, faces), or a mesh of trimesh, Open3D or
    pyvista. It is encoded with the preset "fast" the first time, and then found by its content: in this
    process, and in the user's folder for caches (TESDF_CACHE). `Asset.query` explains the precision.
    """
    rows, shape = _rows(points)
    return _native.asset_of(mesh).signed_distance(rows, precision).reshape(shape)[()]


def contains(mesh: Mesh, points: npt.ArrayLike) -> Any:
    """Whether points [..., 3] are inside of a mesh: [...]; of one point [3] a truth value.

    Meshes are those of `signed_distance`. Points on the surface may count as inside or outside.
    """
    rows, shape = _rows(points)
    return _native.asset_of(mesh).is_inside(rows).reshape(shape)[()]


def closest_point(mesh: Mesh, points: npt.ArrayLike, *, precision: Literal["f64", "f32"] = "f64") -> ClosestPoints:
    """The points of a mesh that are closest to points [..., 3], their faces, and their distances.

    Meshes are those of `signed_distance`.
    """
    rows, shape = _rows(points)
    found = _native.asset_of(mesh).query(rows, precision)
    closest = found.closest_point.reshape(*shape, 3)
    return ClosestPoints(closest, found.face.reshape(shape)[()], np.abs(found.signed_distance).reshape(shape)[()])
