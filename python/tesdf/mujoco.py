"""Contacts of tesdf in MuJoCo, in place of those of convex hulls.

    model = mujoco.MjModel.from_xml_path("screw.xml")
    data = mujoco.MjData(model)
    contacts = tesdf.mujoco.Contacts(model, {"bolt": bolt, "nut": nut})    # geoms and their assets
    while data.time < 1.0:
        contacts.step(model, data)                                         # in place of mj_step

It needs the package `mujoco`, 4.0 or newer.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Union

import numpy as np
import numpy.typing as npt

try:
    import mujoco as mj  # type: ignore[import-untyped]
except ImportError:
    raise ImportError("tesdf.mujoco needs the package mujoco: pip install 'mujoco>=4'") from None

from . import Asset, Box, Capsule, Contacts as Found, Plane, Scene, Sphere

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .bodies import DetectOptions

_Float = npt.NDArray[np.float64]
_Shape = Union[Asset, Plane, Box, Sphere, Capsule]

# The bits of geoms with an asset and of simple geoms. MuJoCo finds the contacts of two simple ones.
_ASSETS, _SIMPLE = 1, 2

# Impedance of a contact with solref="rigid": the share of the constraint that is enforced. A higher
# one makes the nut of the tests neither faster nor its overlaps smaller.
_IMPEDANCE = 0.9


@dataclass(frozen=True)
class _Geom:
    """A geom that takes part, and the pose of its shape's frame in that of the geom."""

    id: int
    shape: _Shape
    scale: float
    rotation: _Float
    translation: _Float


class Contacts:
    """Finds the contacts between geoms of a model, and gives them to MuJoCo's solver.

    geoms: for the names of mesh geoms, the assets that were encoded from the files of their meshes.
    A geom that is a plane, box, sphere or capsule gets None in place of an asset. Contacts are
    found between two geoms of which at least one has an asset. For geoms with an asset, MuJoCo's own
    contacts are switched off (contype = conaffinity = 0), so name all geoms that they may touch.
    As in MuJoCo, no contacts are found within a body, between a body and its parent (other than the
    world), between bodies that do not move, and between bodies that the model excludes.

    A contact has the parameters condim and friction that MuJoCo would give it. Its solref and solimp are

    - solref="rigid": those with which a gap closes within one time step h, and not sooner:
      (-d / h^2, -d / h) with the impedance d = 0.9. Contacts neither depend on a time constant nor
      lose much energy, at time steps of 1 to 5 ms.
    - solref="model": those that MuJoCo would give it.
    - two numbers: these, with the model's solimp.

    The remaining keywords are those of `Scene.detect`. The default mode is "node", the vertices of
    each body in the field of the other; coarse meshes need "exact". The contact distance is 0.5 % of
    the smallest diagonal of an asset if it is not given. To it comes what motion can close within
    1.2 time steps.

    Errors are ValueError and name the geom.
    """

    last: Found | None
    """the contacts of the last detection, None before the first; instances are in the order of `geoms`"""

    def __init__(
        self,
        model: mj.MjModel,
        geoms: Mapping[str, Asset | None],
        *,
        solref: Literal["rigid", "model"] | tuple[float, float] = "rigid",
        **options: Unpack[DetectOptions],
    ) -> None:
        if not any(geoms.values()):
            raise ValueError("geoms has no asset; give the asset of at least one mesh geom")
        self._solref = _solref(solref)
        self._geoms = [_geom(model, name, asset) for name, asset in geoms.items()]
        self._ids = np.array([geom.id for geom in self._geoms])
        self._rotations = np.array([geom.rotation for geom in self._geoms])
        self._translations = np.array([geom.translation for geom in self._geoms])
        self._options: dict[str, Any] = dict(options)
        self._options.setdefault("mode", "node")
        if "contact_distance" not in options:
            self._options["contact_distance"] = 5e-3 * min(
                geom.scale * float(np.linalg.norm(np.diff(geom.shape.bounds, axis=0)))
                for geom in self._geoms
                if isinstance(geom.shape, Asset)
            )
        self._scene = Scene()
        shapes: dict[int, int] = {}
        for geom in self._geoms:
            key = id(geom.shape)
            if key not in shapes:
                shapes[key] = self._scene.add_shape(geom.shape)
            own = _ASSETS if isinstance(geom.shape, Asset) else _SIMPLE
            others = _ASSETS if own == _SIMPLE else _ASSETS | _SIMPLE
            self._scene.add(shapes[key], scale=geom.scale, memberships=own, filter=others)
            if own == _ASSETS:
                model.geom_contype[geom.id] = model.geom_conaffinity[geom.id] = 0
        excluded = list(_excluded(model, self._geoms))
        if excluded:
            self._scene.exclude(np.array(excluded, dtype=np.uint32))
        self.last = None

    @property
    def scene(self) -> Scene:
        """A copy of the scene: the geoms as instances, in the order of `geoms`, at the poses of the
        last detection."""
        return self._scene.__copy__()

    def step(self, model: mj.MjModel, data: mj.MjData) -> None:
        """Does what `mujoco.mj_step` does, with the contacts of this object."""
        if model.opt.integrator == mj.mjtIntegrator.mjINT_RK4:
            raise ValueError("the integrator is RK4, which detects contacts within a step; use Euler or implicitfast")
        mj.mj_step1(model, data)
        if self.add(model, data):
            mj.mj_makeConstraint(model, data)
            mj.mj_island(model, data)
            mj.mj_projectConstraint(model, data)
            mj.mj_fwdVelocity(model, data)
        mj.mj_step2(model, data)

    def add(self, model: mj.MjModel, data: mj.MjData) -> int:
        """Finds contacts at the positions and velocities of `data`, and adds them to `data.contact`.
        Returns their number.

        `data` must have passed `mj_step1` or `mj_forward`. Its constraints have to be made again
        afterwards, as `step` does.
        """
        found = self.detect(model, data)
        count, before = len(found), int(data.ncon)
        if count == 0:
            return 0
        data.ncon = before + 1
        bytes_each = data.contact.dist.strides[0]
        # Half of the memory has to be left for the constraints.
        if (before + count) * bytes_each * 2 > data.narena:
            data.ncon = before
            raise ValueError(
                f"{before + count} contacts of {bytes_each} bytes do not fit the model's memory of {data.narena} "
                "bytes; give it more, as <size memory=\"500M\"/>, or reduce the contacts, as reduce=64"
            )
        data.ncon = before + count
        self._fill(model, data.contact, slice(before, before + count), found)
        return count

    def detect(self, model: mj.MjModel, data: mj.MjData) -> Found:
        """Finds contacts at the positions and velocities of `data`, without adding them."""
        poses = np.zeros((len(self._geoms), 4, 4))
        axes = data.geom_xmat[self._ids].reshape(-1, 3, 3)
        arms = np.einsum("nij,nj->ni", axes, self._translations)
        poses[:, :3, :3] = axes @ self._rotations
        poses[:, :3, 3] = data.geom_xpos[self._ids] + arms
        poses[:, 3, 3] = 1.0
        moved = np.zeros((len(self._geoms), 6))
        for row, geom in zip(moved, self._geoms):
            mj.mj_objectVelocity(model, data, mj.mjtObj.mjOBJ_GEOM, geom.id, row, 0)
        turns, velocities = moved[:, :3], moved[:, 3:] + np.cross(moved[:, :3], arms)
        if not model.opt.disableflags & mj.mjtDisableBit.mjDSBL_GRAVITY:
            # What falls from rest must not pass the other body within the step.
            falls = model.body_weldid[model.geom_bodyid[self._ids]] != 0
            velocities[falls] += model.opt.gravity * model.opt.timestep
        rows = np.arange(len(self._geoms), dtype=np.uint32)
        self._scene.update(rows, poses=poses, velocities=np.hstack([velocities, turns]))
        ahead = 1.2 * model.opt.timestep
        self.last = self._scene.detect(**{"speculative_time": ahead, **self._options})
        return self.last

    def _fill(self, model: mj.MjModel, contact: Any, rows: slice, found: Found) -> None:
        # MuJoCo's normal points from the first geom to the second one.
        first, second = found.instance_b, found.instance_a
        kinds, kind = np.unique(np.stack([first, second], 1), axis=0, return_inverse=True)
        kind = kind.reshape(-1)
        each = [_parameters(model, self._ids[a], self._ids[b], self._solref) for a, b in kinds]
        contact.dist[rows] = found.distance
        contact.pos[rows] = 0.5 * (found.point_a + found.point_b)
        contact.frame[rows] = _frames(found.normal)
        contact.dim[rows] = np.array([p.condim for p in each])[kind]
        contact.friction[rows] = np.array([p.friction for p in each])[kind]
        contact.solref[rows] = np.array([p.solref for p in each])[kind]
        contact.solimp[rows] = np.array([p.solimp for p in each])[kind]
        contact.geom1[rows] = self._ids[first]
        contact.geom2[rows] = self._ids[second]
        contact.geom[rows] = np.stack([self._ids[first], self._ids[second]], 1)
        for name in ("flex", "elem", "vert", "efc_address"):
            getattr(contact, name)[rows] = -1
        for name in ("includemargin", "solreffriction", "mu", "H", "exclude", "adhesion", "surfacevel"):
            getattr(contact, name)[rows] = 0


@dataclass(frozen=True)
class _Parameters:
    condim: int
    friction: _Float
    solref: _Float
    solimp: _Float


def _parameters(
    model: mj.MjModel, first: int, second: int, solref: tuple[float, float] | Literal["rigid", "model"]
) -> _Parameters:
    """The parameters of a contact between two geoms, as MuJoCo combines those of the geoms."""
    order = model.geom_priority[first] - model.geom_priority[second]
    if order:
        chosen = first if order > 0 else second
        condim, friction = model.geom_condim[chosen], model.geom_friction[chosen]
        reference, impedance = model.geom_solref[chosen], model.geom_solimp[chosen]
    else:
        both = [first, second]
        condim, friction = max(model.geom_condim[both]), model.geom_friction[both].max(axis=0)
        weights = np.maximum(model.geom_solmix[both], mj.mjMINVAL)
        weights = weights / weights.sum()
        impedance = weights @ model.geom_solimp[both]
        references = model.geom_solref[both]
        reference = weights @ references if (references[:, 0] > 0).all() else references.min(axis=0)
    if model.opt.enableflags & mj.mjtEnableBit.mjENBL_OVERRIDE:
        reference, impedance = model.opt.o_solref, model.opt.o_solimp
        slide = model.opt.o_friction
    else:
        slide = friction[[0, 0, 1, 2, 2]]
    if solref == "rigid":
        step = model.opt.timestep
        reference = np.array([-_IMPEDANCE / step**2, -_IMPEDANCE / step])
        impedance = np.array([_IMPEDANCE, _IMPEDANCE, 1e-3, 0.5, 2.0])
    elif solref != "model":
        reference = np.array(solref)
    return _Parameters(int(condim), slide, reference, impedance)


def _frames(normals: _Float) -> _Float:
    """[N, 9]: each normal, and two directions that make a right-handed frame with it."""
    helper = np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    second = np.cross(normals, helper)
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    return np.hstack([normals, second, np.cross(normals, second)])


def _solref(given: Any) -> Any:
    if isinstance(given, str):
        if given not in ("rigid", "model"):
            raise ValueError(f"solref: {given!r}; expected 'rigid', 'model' or two numbers")
        return given
    numbers = np.asarray(given, dtype=np.float64)
    if numbers.shape != (2,) or not np.isfinite(numbers).all():
        raise ValueError(f"solref: {given!r}; expected 'rigid', 'model' or two numbers")
    return float(numbers[0]), float(numbers[1])


def _geom(model: mj.MjModel, name: str, asset: Asset | None) -> _Geom:
    number = mj.mj_name2id(model, mj.mjtObj.mjOBJ_GEOM, name)
    if number < 0:
        names = (mj.mj_id2name(model, mj.mjtObj.mjOBJ_GEOM, k) for k in range(model.ngeom))
        raise ValueError(f"there is no geom {name!r}; the named ones are {[n for n in names if n]}")
    kind = mj.mjtGeom(model.geom_type[number])
    identity = np.eye(3), np.zeros(3)
    if asset is not None:
        if kind != mj.mjtGeom.mjGEOM_MESH:
            raise ValueError(f"geom {name!r} is a {_word(kind)}; an asset needs a mesh geom")
        return _mesh(model, number, name, asset)
    size = model.geom_size[number]
    if kind == mj.mjtGeom.mjGEOM_PLANE:
        return _Geom(number, Plane(), 1.0, *identity)
    if kind == mj.mjtGeom.mjGEOM_BOX:
        return _Geom(number, Box(tuple(size)), 1.0, *identity)
    if kind == mj.mjtGeom.mjGEOM_SPHERE:
        return _Geom(number, Sphere(size[0]), 1.0, *identity)
    if kind == mj.mjtGeom.mjGEOM_CAPSULE:
        return _Geom(number, Capsule(size[1], size[0]), 1.0, *identity)
    raise ValueError(f"geom {name!r} is a {_word(kind)}; without an asset, expected a plane, box, sphere or capsule")


def _word(kind: mj.mjtGeom) -> str:
    return str(kind.name).removeprefix("mjGEOM_").lower()


def _mesh(model: mj.MjModel, number: int, name: str, asset: Asset) -> _Geom:
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
    of_asset = asset.bounds * scales[0]
    if np.abs(of_mesh - of_asset).max() > 1e-5 * np.linalg.norm(np.ptp(of_mesh, axis=0)):
        raise ValueError(
            f"geom {name!r}: its mesh spans {of_mesh.tolist()}, but the asset {of_asset.tolist()}; encode the file of "
            "the mesh, in the unit of the model or with the mesh's scale"
        )
    # x_geom = R^T (x_file - pos).
    return _Geom(number, asset, float(scales[0]), rotation.T, -rotation.T @ model.mesh_pos[mesh])


def _excluded(model: mj.MjModel, geoms: list[_Geom]) -> Iterator[tuple[int, int]]:
    """The pairs of geoms between which MuJoCo finds no contacts."""
    excluded = {(int(s) >> 16, int(s) & 0xFFFF) for s in model.exclude_signature}
    parents = not model.opt.disableflags & mj.mjtDisableBit.mjDSBL_FILTERPARENT
    for i, a in enumerate(geoms):
        for j, b in enumerate(geoms[:i]):
            bodies = [int(model.geom_bodyid[g.id]) for g in (a, b)]
            rigid = [int(model.body_weldid[body]) for body in bodies]
            above = [int(model.body_weldid[model.body_parentid[body]]) for body in rigid]
            is_child = parents and 0 not in rigid and (rigid[0] == above[1] or rigid[1] == above[0])
            if rigid[0] == rigid[1] or is_child or tuple(bodies) in excluded or tuple(bodies[::-1]) in excluded:
                yield j, i
