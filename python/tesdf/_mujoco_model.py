"""Geoms of a model of MuJoCo, for the couplings to MuJoCo and to MJWarp."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Union

import numpy as np
import numpy.typing as npt

try:
    import mujoco as mj  # type: ignore[import-untyped]
except ImportError:
    raise ImportError(
        "tesdf.mujoco and tesdf.mujoco_warp need the package mujoco: pip install 'mujoco>=4'"
    ) from None

from . import Asset, Box, Capsule, Cylinder, Plane, Sphere
from ._coupling import RIGID_SOLIMP, Float, Placed, check_bounds, rigid_solref

__all__ = ["Geoms", "Integer", "Parameters", "Properties", "Solref", "checked_solref", "combine", "mj", "stiffness", "weigh"]

Solref = Union[Literal["rigid", "model"], tuple[float, float]]
Integer = npt.NDArray[np.int64]


class Geoms:
    """The geoms that take part, in the order of the caller's mapping. Switches MuJoCo's own contacts
    of geoms with an asset off."""

    def __init__(self, model: mj.MjModel, geoms: Mapping[str, Asset | None]) -> None:
        if not any(geoms.values()):
            raise ValueError("geoms has no asset; give the asset of at least one mesh geom")
        numbers = [_number(model, name) for name in geoms]
        self.ids: Integer = np.array(numbers)
        self.shapes = [_placed(model, number, name, geoms[name]) for number, name in zip(numbers, geoms)]
        self.excluded = list(_excluded(model, numbers))
        apart = {place: {place} for place in range(len(numbers))}
        for a, b in self.excluded:
            apart[a].add(b)
            apart[b].add(a)
        for place, (name, asset) in enumerate(geoms.items()):
            if asset is not None and len(apart[place]) == len(numbers):
                raise ValueError(
                    f"geom {name!r} meets no other of geoms, and its contacts with all others are switched off: name the"
                    " geoms that it may touch, such as {'floor': None}, which takes the shape of a plane, box, sphere,"
                    " capsule or cylinder from the model"
                )
        self.moves = model.body_weldid[model.geom_bodyid[self.ids]] != 0
        """[N] whether a geom can move"""
        for number, asset in zip(numbers, geoms.values()):
            if asset is not None:
                model.geom_contype[number] = model.geom_conaffinity[number] = 0
                weigh(model, number)


@dataclass(frozen=True)
class Properties:
    """What decides on the parameters of a contact, a row for each geom, as in the model."""

    priority: npt.NDArray[Any]
    condim: npt.NDArray[Any]
    solmix: npt.NDArray[Any]
    friction: npt.NDArray[Any]
    solref: npt.NDArray[Any]
    solimp: npt.NDArray[Any]


@dataclass(frozen=True)
class Parameters:
    """A row for each pair of geoms: slide, slide, spin, roll, roll in `friction`."""

    condim: npt.NDArray[Any]
    friction: npt.NDArray[Any]
    solref: npt.NDArray[Any]
    solimp: npt.NDArray[Any]


def combine(geoms: Properties, first: Integer, second: Integer) -> Parameters:
    """The parameters of contacts between two geoms, as MuJoCo combines those of the geoms."""
    order = geoms.priority[first] - geoms.priority[second]
    chosen, equal = np.where(order > 0, first, second), order == 0
    condim = np.where(equal, np.maximum(geoms.condim[first], geoms.condim[second]), geoms.condim[chosen])
    equal = equal[:, None]
    friction = np.where(equal, np.maximum(geoms.friction[first], geoms.friction[second]), geoms.friction[chosen])
    mix = np.maximum(np.stack([geoms.solmix[first], geoms.solmix[second]], 1), mj.mjMINVAL)
    weight = (mix[:, 0] / mix.sum(axis=1))[:, None]
    mixed = weight * geoms.solimp[first] + (1 - weight) * geoms.solimp[second]
    solimp = np.where(equal, mixed, geoms.solimp[chosen])
    a, b = geoms.solref[first], geoms.solref[second]
    standard = (a[:, :1] > 0) & (b[:, :1] > 0)
    mixed = np.where(standard, weight * a + (1 - weight) * b, np.minimum(a, b))
    solref = np.where(equal, mixed, geoms.solref[chosen])
    return Parameters(condim, friction[:, [0, 0, 1, 2, 2]], solref, solimp)


def stiffness(given: Solref, time_step: float | npt.NDArray[Any], of_model: Parameters) -> Parameters:
    """The same parameters with the caller's solref. The time step is a number or one for each row."""
    if given == "model":
        return of_model
    if given == "rigid":
        step = np.broadcast_to(time_step, len(of_model.condim))
        solref, solimp = rigid_solref(step), np.tile(RIGID_SOLIMP, (len(step), 1))
    else:
        solref = np.tile(given, (len(of_model.condim), 1))
        solimp = of_model.solimp
    return Parameters(of_model.condim, of_model.friction, solref, solimp)


def checked_solref(given: Any) -> Solref:
    if isinstance(given, str):
        if given == "rigid" or given == "model":
            return given  # type: ignore[return-value]
        raise ValueError(f"solref: {given!r}; expected 'rigid', 'model' or two numbers")
    numbers = np.asarray(given, dtype=np.float64)
    if numbers.shape != (2,) or not np.isfinite(numbers).all():
        raise ValueError(f"solref: {given!r}; expected 'rigid', 'model' or two numbers")
    return float(numbers[0]), float(numbers[1])


def _number(model: mj.MjModel, name: str) -> int:
    number = mj.mj_name2id(model, mj.mjtObj.mjOBJ_GEOM, name)
    if number < 0:
        names = (mj.mj_id2name(model, mj.mjtObj.mjOBJ_GEOM, k) for k in range(model.ngeom))
        raise ValueError(f"there is no geom {name!r}; the named ones are {[n for n in names if n]}")
    return int(number)


def weigh(model: mj.MjModel, number: int) -> None:
    """MuJoCo chooses the stiffness of a contact by the inverse masses of its bodies, which it takes at their
    centres of mass. That of a body on a hinge through its centre is zero up to rounding, so its contacts become
    so stiff that the solver fails: a pair of gears flew apart. Such a body gets the inverse mass at the border of
    its geom."""
    weight = model.body_invweight0[model.geom_bodyid[number]]
    at_border = weight[1] * model.geom_rbound[number] ** 2
    if weight[0] < 1e-6 * at_border:
        weight[0] = at_border


def _placed(model: mj.MjModel, number: int, name: str, asset: Asset | None) -> Placed:
    kind = mj.mjtGeom(model.geom_type[number])
    identity = np.eye(3), np.zeros(3)
    if asset is not None:
        if kind != mj.mjtGeom.mjGEOM_MESH:
            raise ValueError(f"geom {name!r} is a {_word(kind)}; an asset needs a mesh geom")
        return _mesh(model, number, name, asset)
    size = model.geom_size[number]
    if kind == mj.mjtGeom.mjGEOM_PLANE:
        return Placed(Plane(), 1.0, *identity)
    if kind == mj.mjtGeom.mjGEOM_BOX:
        return Placed(Box(tuple(size)), 1.0, *identity)
    if kind == mj.mjtGeom.mjGEOM_SPHERE:
        return Placed(Sphere(size[0]), 1.0, *identity)
    if kind == mj.mjtGeom.mjGEOM_CAPSULE:
        return Placed(Capsule(size[1], size[0]), 1.0, *identity)
    if kind == mj.mjtGeom.mjGEOM_CYLINDER:
        return Placed(Cylinder(size[1], size[0]), 1.0, *identity)
    raise ValueError(f"geom {name!r} is a {_word(kind)}; without an asset, expected a plane, box, sphere, capsule or cylinder")


def _word(kind: mj.mjtGeom) -> str:
    return str(kind.name).removeprefix("mjGEOM_").lower()


def _mesh(model: mj.MjModel, number: int, name: str, asset: Asset) -> Placed:
    """The compiler moves a mesh to its centre of mass and its principal axes, and scales it before.
    This finds the way back to the coordinates of the file."""
    mesh = model.geom_dataid[number]
    scales = model.mesh_scale[mesh]
    if not (scales > 0).all() or np.ptp(scales) > 1e-12 * scales[0]:
        raise ValueError(f"geom {name!r}: its mesh has the scale {scales}; expected one positive number three times")
    numbers = np.zeros(9)
    mj.mju_quat2Mat(numbers, model.mesh_quat[mesh])
    rotation = numbers.reshape(3, 3)
    start = model.mesh_vertadr[mesh]
    vertices = model.mesh_vert[start : start + model.mesh_vertnum[mesh]] @ rotation.T + model.mesh_pos[mesh]
    of_mesh = np.array([vertices.min(axis=0), vertices.max(axis=0)])
    hint = "encode the file of the mesh, in the unit of the model or with the mesh's scale"
    check_bounds(f"geom {name!r}", of_mesh, asset.bounds * scales[0], hint)
    # x_geom = R^T (x_file - pos).
    return Placed(asset, float(scales[0]), rotation.T, -rotation.T @ model.mesh_pos[mesh])


def _excluded(model: mj.MjModel, geoms: list[int]) -> Iterator[tuple[int, int]]:
    """The pairs of geoms, by their places in the list, between which MuJoCo finds no contacts."""
    excluded = {(int(s) >> 16, int(s) & 0xFFFF) for s in model.exclude_signature}
    parents = not model.opt.disableflags & mj.mjtDisableBit.mjDSBL_FILTERPARENT
    for i, a in enumerate(geoms):
        for j, b in enumerate(geoms[:i]):
            bodies = [int(model.geom_bodyid[geom]) for geom in (a, b)]
            rigid = [int(model.body_weldid[body]) for body in bodies]
            above = [int(model.body_weldid[model.body_parentid[body]]) for body in rigid]
            is_child = parents and 0 not in rigid and (rigid[0] == above[1] or rigid[1] == above[0])
            if rigid[0] == rigid[1] or is_child or tuple(bodies) in excluded or tuple(bodies[::-1]) in excluded:
                yield j, i
