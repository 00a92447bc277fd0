"""Contacts of tesdf in MJWarp, MuJoCo on the arrays of NVIDIA Warp, for one world or many.

    model = mujoco.MjModel.from_xml_path("screw.xml")
    contacts = tesdf.mujoco_warp.Contacts(model, {"bolt": bolt, "nut": nut}, nworld=16)
    m = mujoco_warp.put_model(model)                # after Contacts, which changes the model
    d = mujoco_warp.make_data(model, nworld=16, nconmax=10_000, njmax=10_000)
    for _ in range(1000):
        contacts.step(m, d)                         # in place of mujoco_warp.step

It needs the packages `mujoco` and `mujoco-warp`, 4.0 or newer. Contacts are found on the processor, or with
device="cuda:0" on a GPU: where MJWarp runs on the same one, poses and contacts stay there.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

try:
    import mujoco_warp as mjw  # type: ignore[import-untyped]
    import warp as wp
except ImportError:
    raise ImportError(
        "tesdf.mujoco_warp needs the package mujoco-warp: pip install 'mujoco-warp>=4'"
    ) from None

from . import Asset, Contacts as Found, DeviceContacts, Scene
from ._coupling import Detector, Float, kinds_of
from ._mujoco_model import Geoms, Integer, Parameters, Properties, Solref, checked_solref, combine, mj, stiffness
from ._mujoco_warp_kernels import fill, look_ahead, place
from ._warp import Memory, cuda_number, in_place
from ._native import contact_frames

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .bodies import DetectOptions

# `ContactType.CONSTRAINT` of MJWarp, which does not export it: the contact is for the solver.
_FOR_SOLVER = 1

_INTEGRATORS = (mjw.IntegratorType.EULER, mjw.IntegratorType.IMPLICITFAST, mjw.IntegratorType.IMPLICIT)

_WITHOUT_CONTACTS = mjw.DisableBit.CONSTRAINT | mjw.DisableBit.CONTACT

# MJWarp keeps contacts with dist < includemargin. For a distance of zero this is includemargin.
_ABOVE_ZERO = 1e-30


# Fields of `d.contact` that are the same for all contacts.
_SAME = {
    "solreffriction": 0.0,
    "adhesion": 0.0,
    "surfacevel": 0.0,
    "flex": -1,
    "elem": -1,
    "vert": -1,
    "type": _FOR_SOLVER,
}


class Contacts:
    """Finds the contacts between geoms of a model in each world, and gives them to MJWarp's solver.

    The geoms, solref and other keywords are those of `tesdf.mujoco.Contacts`. Make this object before
    `mujoco_warp.put_model(model)`: it switches MuJoCo's own contacts of geoms with an asset off.

    nworld: the number of worlds, as in `mujoco_warp.make_data`. Friction, solref, solimp, solmix,
    gravity and time step are read from the model of MJWarp in each step, for each world its own.

    Give `make_data` room for the contacts (nconmax for each world, or naconmax for all) and their rows
    (njmax). Too little room is a ValueError that names the argument.
    """

    def __init__(
        self,
        model: mj.MjModel,
        geoms: Mapping[str, Asset | None],
        *,
        nworld: int = 1,
        solref: Solref = "rigid",
        **options: Unpack[DetectOptions],
    ) -> None:
        if nworld < 1:
            raise ValueError(f"nworld: {nworld}; expected at least 1")
        self._solref = checked_solref(solref)
        self._geoms = Geoms(model, geoms)
        self._ids = self._geoms.ids
        self._bodies = model.geom_bodyid[self._ids]
        self._roots = model.body_rootid[self._bodies]
        self._with_asset = self._ids[[asset is not None for asset in geoms.values()]]
        self._worlds = nworld
        self._on_device: _OnDevice | None = None
        count = len(self._ids)
        self._detector = Detector(
            self._geoms.shapes * nworld,
            np.repeat(np.arange(nworld), count),
            [(w * count + a, w * count + b) for w in range(nworld) for a, b in self._geoms.excluded],
            options,
        )

    @property
    def last(self) -> Found | DeviceContacts | None:
        """The contacts of the last detection in all worlds, None before the first; `DeviceContacts` where they
        stay on a GPU. The instance of geom i in world w is w * len(geoms) + i."""
        there = self._detector.last_on_device
        return self._detector.last if there is None else there

    @property
    def scene(self) -> Scene:
        """A copy of the scene of all worlds, at the poses of the last detection."""
        return self._detector.scene_now()

    def step(self, m: mjw.Model, d: mjw.Data) -> None:
        """Does what `mujoco_warp.step` does, with the contacts of this object.

        It sets m.opt.run_collision_detection to False. It cannot be captured in a CUDA graph.
        """
        self._check(m, d)
        if m.opt.disableflags & _WITHOUT_CONTACTS:
            # The solver reads the rows of contacts, which are those of an earlier step.
            d.nacon.zero_()
            mjw.step(m, d)
            return
        m.opt.run_collision_detection = False
        mjw.fwd_kinematics(m, d)
        mjw.com_vel(m, d)
        mjw.collision(m, d)
        first = int(d.nacon.numpy()[0])
        count = self.add(m, d)
        mjw.step1(m, d)
        self._check_rows(d)
        if count:
            wp.launch(
                look_ahead,
                dim=count,
                inputs=[
                    first,
                    int(m.opt.cone == mjw.ConeType.ELLIPTIC),
                    int(not m.opt.disableflags & mjw.DisableBit.REFSAFE),
                    m.opt.timestep,
                    d.contact.dist,
                    d.contact.worldid,
                    d.contact.efc_address,
                    d.contact.solref,
                    d.contact.solimp,
                    d.efc.vel,
                ],
                outputs=[d.efc.aref, d.efc.margin],
                device=d.nacon.device,
            )
        mjw.step2(m, d)

    def add(self, m: mjw.Model, d: mjw.Data) -> int:
        """Finds contacts at the positions and velocities of `d`, and adds them to `d.contact` after
        the `d.nacon` that are there. Returns their number.

        `d` must have passed `fwd_kinematics` and `com_vel`. `step` also makes the rows of contacts
        that do not touch yet look ahead; without this such a contact pushes before it touches.
        """
        stays = self._detector.leaves_on(cuda_number(d.nacon.device))
        found = self._detect_there(m, d) if stays else self.detect(m, d)
        count, before = len(found), int(d.nacon.numpy()[0])
        if before + count > d.naconmax:
            raise ValueError(
                f"{before + count} contacts in {d.nworld} worlds, but the data has room for {d.naconmax}; make it with "
                f"make_data(…, naconmax={_rounded(before + count)}) or reduce the contacts, as reduce=64"
            )
        if count == 0:
            return 0
        if isinstance(found, DeviceContacts):
            self._fill_there(m, d, found, before)
        else:
            for name, rows in self._rows(m, found).items():
                target = getattr(d.contact, name)
                wp.copy(target, wp.array(rows, dtype=target.dtype, device="cpu"), dest_offset=before, count=count)
        for name, value in _SAME.items():
            target = getattr(d.contact, name)
            # MJWarp makes no room for what the model does not have, such as surface velocities.
            if target.size:
                target[before : before + count].fill_(value)
        d.nacon.fill_(before + count)
        return count

    def detect(self, m: mjw.Model, d: mjw.Data) -> Found:
        """Finds contacts at the positions and velocities of `d`, without adding them."""
        self._check(m, d)
        moved = _array(d.cvel)[:, self._bodies]
        positions = _array(d.geom_xpos)[:, self._ids]
        # Of the geom's origin, from those of the tree's centre of mass.
        arms = positions - _array(d.subtree_com)[:, self._roots]
        angular = moved[..., :3]
        linear = moved[..., 3:] + np.cross(angular, arms)
        steps = _array(m.opt.timestep)
        if not m.opt.disableflags & mjw.DisableBit.GRAVITY:
            # What falls from rest must not pass the other body within the step.
            linear[:, self._geoms.moves] += (_array(m.opt.gravity) * steps[:, None])[:, None]
        return self._detector.detect(
            _array(d.geom_xmat)[:, self._ids], positions, linear, angular, float(steps.max())
        )

    def _detect_there(self, m: mjw.Model, d: mjw.Data) -> DeviceContacts:
        """As `detect`, where MJWarp has its arrays."""
        self._check(m, d)
        here = d.nacon.device
        if self._on_device is None or self._on_device.device != here:
            self._on_device = _OnDevice(here, self)
        own = self._on_device
        wp.launch(
            place,
            dim=(self._worlds, len(self._ids)),
            inputs=[
                own.geoms,
                own.bodies,
                own.roots,
                own.falls if not m.opt.disableflags & mjw.DisableBit.GRAVITY else own.none,
                own.rotations,
                own.translations,
                m.opt.timestep,
                m.opt.gravity,
                d.geom_xpos,
                d.geom_xmat,
                d.cvel,
                d.subtree_com,
            ],
            outputs=[own.poses, own.velocities],
            device=here,
        )
        # tesdf works in a stream of its own, which does not wait for Warp's.
        wp.synchronize_device(here)
        step = float(_array(m.opt.timestep).max())
        return self._detector.detect_on_device(Memory(own.poses), Memory(own.velocities), step)

    def _fill_there(self, m: mjw.Model, d: mjw.Data, found: DeviceContacts, before: int) -> None:
        """Writes the fields of `d.contact` where they are."""
        here, count, contact = d.nacon.device, len(found), d.contact
        one, two = np.triu_indices(len(self._ids), 1)
        pairs = np.zeros((len(self._ids),) * 2, np.int32)
        pairs[one, two] = pairs[two, one] = np.arange(len(one))
        world = np.repeat(np.arange(self._worlds), len(one))
        each, kind = self._parameters(m, world, np.tile(self._ids[np.stack([one, two], 1)], (self._worlds, 1)))
        parameters: list[Any] = [
            wp.array(rows[kind], dtype=target.dtype, device=here)
            for rows, target in (
                (each.condim, contact.dim),
                (each.friction, contact.friction),
                (each.solref, contact.solref),
                (each.solimp, contact.solimp),
            )
        ]
        wp.launch(
            fill,
            dim=count,
            inputs=[
                before,
                _ABOVE_ZERO,
                self._on_device.geoms,  # type: ignore[union-attr]
                wp.array(pairs, device=here),
                len(one),
                *parameters,
                in_place(found.point_a, wp.vec3, here),
                in_place(found.point_b, wp.vec3, here),
                in_place(found.normal, wp.vec3, here),
                in_place(found.distance, wp.float32, here),
                in_place(found.instances, wp.vec2i, here),
            ],
            outputs=[
                contact.dist,
                contact.pos,
                contact.frame,
                contact.includemargin,
                contact.friction,
                contact.solref,
                contact.solimp,
                contact.dim,
                contact.geom,
                contact.worldid,
                contact.geomcollisionid,
            ],
            device=here,
        )

    def _check(self, m: mjw.Model, d: mjw.Data) -> None:
        if d.nworld != self._worlds:
            raise ValueError(
                f"the data has {d.nworld} worlds, but the contacts {self._worlds}; give Contacts nworld={d.nworld}"
            )
        if m.opt.integrator not in _INTEGRATORS:
            name = mjw.IntegratorType(m.opt.integrator).name
            raise ValueError(f"the integrator is {name}; expected EULER, IMPLICITFAST or IMPLICIT")
        if m.opt.enableflags & mjw.EnableBit.SLEEP:
            raise ValueError("the model lets bodies sleep, which only MJWarp's own contacts can end; switch sleep off")
        if np.isin(m.nxn_geom_pair_filtered.numpy(), self._with_asset).any():
            raise ValueError(
                "the model of MJWarp still finds contacts of these geoms; call put_model after Contacts(model, …)"
            )

    def _check_rows(self, d: mjw.Data) -> None:
        rows = _array(d.nefc)
        world = int(rows.argmax())
        if rows[world] > d.njmax:
            raise ValueError(
                f"world {world} has {int(rows[world])} constraints, but the data has room for {d.njmax}; make it with "
                f"make_data(…, njmax={_rounded(rows[world])}) or reduce the contacts, as reduce=64"
            )
        dropped = (d.overflow.numpy() & int(mjw.OverflowType.NJMAX_NNZ)) != 0
        if dropped.any():
            raise ValueError(
                f"the constraints of world {int(dropped.argmax())} have more than njmax_nnz = {d.njmax_nnz} numbers that "
                "are not zero; make the data with make_data(…, njmax_nnz=njmax * model.nv)"
            )

    def _rows(self, m: mjw.Model, found: Found) -> dict[str, Any]:
        """The rows of each field of `d.contact`."""
        count = len(self._ids)
        # MuJoCo's normal points from the first geom to the second one.
        pairs = np.stack([found.instance_b, found.instance_a], 1).astype(np.int64)
        world = pairs[:, 0] // count
        geoms = self._ids[pairs % count]
        each, kind = self._parameters(m, world, geoms)
        rows = len(found)
        distance = found.distance.astype(np.float32)
        reals: dict[str, Any] = {
            "dist": distance,
            "pos": 0.5 * (found.point_a + found.point_b),
            "frame": contact_frames(found.normal),
            # The distance to the margin is the gap with the opposite sign; `look_ahead` turns it.
            "includemargin": np.maximum(2 * distance, _ABOVE_ZERO),
            "friction": each.friction[kind],
            "solref": each.solref[kind],
            "solimp": each.solimp[kind],
        }
        integers: dict[str, Any] = {
            "dim": each.condim[kind],
            "geom": geoms,
            "worldid": world,
            "geomcollisionid": np.arange(rows),
        }
        return {
            **{name: np.ascontiguousarray(array, np.float32) for name, array in reals.items()},
            **{name: np.ascontiguousarray(array, np.int32) for name, array in integers.items()},
        }

    def _parameters(self, m: mjw.Model, world: Integer, geoms: Integer) -> tuple[Parameters, Integer]:
        """The parameters of each kind of contact, and the kind of each contact."""
        kinds, kind = kinds_of(np.column_stack([world, geoms]))
        each = {
            name: _of_each_geom(getattr(m, "geom_" + name), self._worlds)
            for name in ("solmix", "friction", "solref", "solimp")
        }
        same = {
            name: np.tile(getattr(m, "geom_" + name).numpy(), self._worlds) for name in ("priority", "condim")
        }
        first, second = (kinds[:, 0] * m.ngeom + kinds[:, k] for k in (1, 2))
        steps = _array(m.opt.timestep)
        combined = combine(Properties(**same, **each), first, second)
        return stiffness(self._solref, steps[kinds[:, 0] % len(steps)], combined), kind


class _OnDevice:
    """What the coupling keeps on the device of MJWarp."""

    def __init__(self, device: Any, of: Contacts) -> None:
        geoms, count = of._geoms, of._worlds * len(of._ids)
        self.device: Any = device
        self.geoms: Any = wp.array(of._ids, dtype=wp.int32, device=device)
        self.bodies: Any = wp.array(of._bodies, dtype=wp.int32, device=device)
        self.roots: Any = wp.array(of._roots, dtype=wp.int32, device=device)
        self.falls: Any = wp.array(geoms.moves.astype(np.int32), device=device)
        self.none: Any = wp.zeros_like(self.falls)
        quaternions = np.zeros((len(of._ids), 4))
        for quaternion, shape in zip(quaternions, geoms.shapes):
            mj.mju_mat2Quat(quaternion, shape.rotation.ravel())
        self.rotations: Any = wp.array(quaternions[:, [1, 2, 3, 0]], dtype=wp.quat, device=device)
        self.translations: Any = wp.array([shape.translation for shape in geoms.shapes], dtype=wp.vec3, device=device)
        self.poses: Any = wp.zeros((count, 7), dtype=float, device=device)
        self.velocities: Any = wp.zeros((count, 6), dtype=float, device=device)


def _array(given: Any) -> Float:
    """A copy in f64, from whichever device."""
    return np.asarray(given.numpy(), dtype=np.float64)


def _of_each_geom(given: Any, worlds: int) -> Float:
    """A row for each geom of each world, of an array that may have a row for one world only."""
    numbers = _array(given)
    return numbers[np.arange(worlds) % len(numbers)].reshape(-1, *numbers.shape[2:])


def _rounded(count: float) -> int:
    """A size with some room to spare, in two digits."""
    size = 1.3 * count
    unit = 10 ** max(int(np.log10(size)) - 1, 0)
    return int(np.ceil(size / unit) * unit)
