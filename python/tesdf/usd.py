"""Meshes of USD files, read by `usd-core` (the module `pxr`), which is not installed with tesdf.

    mesh = tesdf.read_usd("scene.usda", prim="/World/gripper")
    asset = tesdf.encode(mesh, unit=mesh.unit)
    asset = tesdf.encode("scene.usda")                  # all meshes of the stage, with its unit
"""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _native
from .errors import MeshError

# metersPerUnit of a stage, and tesdf's name of the unit.
_UNITS = {1.0: "m", 0.1: "dm", 0.01: "cm", 0.001: "mm", 1e-6: "um", 0.0254: "in", 0.3048: "ft", 0.9144: "yd", 1000.0: "km"}


class UsdMesh(NamedTuple):
    """The meshes below a prim as one mesh."""

    vertices: npt.NDArray[np.float64]
    """[V, 3], in the coordinates of the world and the unit of the stage"""
    faces: npt.NDArray[np.uint32]
    """[F, 3], counter-clockwise seen from outside; polygons are split into triangles"""
    unit: str | None
    """name of the unit: the stage's metersPerUnit; None if it is no unit that has a name"""
    up_axis: str
    """"Y" or "Z": the stage's upAxis; vertices are not turned"""
    prims: tuple[str, ...]
    """paths of the meshes, in the order of the faces"""
    notes: tuple[str, ...]
    """what was assumed or left out, one sentence each"""


def read_usd(path: str | os.PathLike[str], *, prim: str | None = None) -> UsdMesh:
    """Reads the meshes of a USD file (.usd, .usda, .usdc, .usdz) at the default time.

    - prim: path of the prim at which to begin. None reads the whole stage, without invisible meshes
      and without those of the purpose `guide`.

    Vertices are in world coordinates: the transforms of all prims above a mesh are applied, and
    mirrored meshes and those of the orientation leftHanded are turned over, so outward stays outward.
    The unit is that of metersPerUnit, and nothing is scaled; upAxis changes nothing. A subdivision
    scheme is not applied: the faces are those of the control mesh. Instances are read as meshes of
    their own.

    Raises ImportError without usd-core, OSError if the file cannot be read, and MeshError if it has
    no mesh or its indices are wrong.
    """
    try:
        from pxr import Tf, Usd, UsdGeom  # type: ignore[import-untyped]  # it has no types
    except ImportError as error:
        raise ImportError(f"USD files are read by usd-core, which is not installed ({error}): pip install usd-core") from error

    name = os.fspath(path)
    os.stat(name)
    try:
        stage = Usd.Stage.Open(name)
    except Tf.ErrorException as error:
        raise MeshError(f"{name}: USD cannot open it: {error}; open it in usdview, or export it again") from error
    root = stage.GetPseudoRoot() if prim is None else stage.GetPrimAtPath(prim)
    if not root:
        raise MeshError(f"{name}: there is no prim {prim}; expected a path such as /World/part")
    parts = _Parts(name, UsdGeom, Usd)
    for found in Usd.PrimRange(root, Usd.TraverseInstanceProxies()):
        if found.IsA(UsdGeom.Mesh):
            parts.add(found, everything=prim is not None)
    if not parts.points:
        raise MeshError(f"{name}: it has no mesh{'' if prim is None else f' at or below {prim}'}{parts.left_out()}")
    vertices, faces, notes = _native.polygons(
        np.concatenate(parts.points), np.concatenate(parts.counts), np.concatenate(parts.corners)
    )
    metres = float(UsdGeom.GetStageMetersPerUnit(stage))
    unit = next((unit for length, unit in _UNITS.items() if abs(length - metres) <= 1e-9 * length), None)
    more = () if unit else (f"metersPerUnit is {metres}, which is no unit with a name",)
    up = str(UsdGeom.GetStageUpAxis(stage))
    return UsdMesh(vertices, faces, unit, up, tuple(parts.prims), (*parts.notes(), *more, *notes))


class _Parts:
    """Points and polygons of several meshes."""

    def __init__(self, name: str, geom: Any, usd: Any) -> None:
        self._name, self._geom = name, geom
        self._poses = geom.XformCache(usd.TimeCode.Default())
        self._base = 0
        self._hidden = self._guides = 0
        self._subdivided: list[str] = []
        self.points: list[npt.NDArray[np.float64]] = []
        self.counts: list[npt.NDArray[np.int64]] = []
        self.corners: list[npt.NDArray[np.int64]] = []
        self.prims: list[str] = []

    def add(self, prim: Any, *, everything: bool) -> None:
        mesh, image = self._geom.Mesh(prim), self._geom.Imageable(prim)
        path = str(prim.GetPath())
        if not everything and image.ComputePurpose() == self._geom.Tokens.guide:
            self._guides += 1
            return
        if not everything and image.ComputeVisibility() == self._geom.Tokens.invisible:
            self._hidden += 1
            return
        points = np.asarray(mesh.GetPointsAttr().Get() or np.empty((0, 3)), np.float64).reshape(-1, 3)
        counts = np.asarray(mesh.GetFaceVertexCountsAttr().Get() or (), np.int64)
        corners = np.asarray(mesh.GetFaceVertexIndicesAttr().Get() or (), np.int64)
        if not len(counts):
            return
        if counts.min() < 3 or counts.sum() != len(corners):
            raise MeshError(
                f"{self._name}: {path}: faceVertexCounts add up to {counts.sum()} with a least value of {counts.min()}, and "
                f"there are {len(corners)} faceVertexIndices; expected as many, and at least 3 for each face"
            )
        if corners.min() < 0 or corners.max() >= len(points):
            raise MeshError(
                f"{self._name}: {path}: faceVertexIndices are from {corners.min()} to {corners.max()}, and there are "
                f"{len(points)} points; expected 0 to {len(points) - 1}"
            )
        # Row vectors are multiplied from the left.
        pose = np.array(self._poses.GetLocalToWorldTransform(prim), np.float64)
        is_left = mesh.GetOrientationAttr().Get() == self._geom.Tokens.leftHanded
        if is_left != (np.linalg.det(pose[:3, :3]) < 0):
            ends = np.repeat(np.cumsum(counts), counts)
            starts = ends - np.repeat(counts, counts)
            corners = corners[starts + ends - 1 - np.arange(len(corners))]
        holes = mesh.GetHoleIndicesAttr().Get()
        if holes is not None and len(holes):
            keep = ~np.isin(np.arange(len(counts)), np.asarray(holes))
            counts, corners = counts[keep], corners[np.repeat(keep, counts)]
        scheme = mesh.GetSubdivisionSchemeAttr().Get()
        if scheme != self._geom.Tokens.none:
            self._subdivided.append(path)
        self.points.append(points @ pose[:3, :3] + pose[3, :3])
        self.counts.append(counts)
        self.corners.append(corners + self._base)
        self.prims.append(path)
        self._base += len(points)

    def left_out(self) -> str:
        found = [(self._hidden, "invisible"), (self._guides, "of the purpose guide")]
        named = [f"{count} {what}" for count, what in found if count]
        return f" ({', '.join(named)}: name it by prim to read it)" if named else ""

    def notes(self) -> list[str]:
        notes = [f"meshes left out{self.left_out()}"] if self.left_out() else []
        if self._subdivided:
            notes.append(
                f"a subdivision scheme is not applied: the control mesh of {len(self._subdivided)} meshes was read (the first is "
                f"{self._subdivided[0]})"
            )
        return notes
