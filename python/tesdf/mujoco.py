"""Contacts of tesdf in MuJoCo, in place of those of convex hulls.

    model = mujoco.MjModel.from_xml_path("screw.xml")
    data = mujoco.MjData(model)
    contacts = tesdf.mujoco.Contacts(model, {"bolt": bolt, "nut": nut})    # geoms and their assets
    while data.time < 1.0:
        contacts.step(model, data)                                         # in place of mj_step

It needs the package `mujoco`, 4.0 or newer.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from . import Asset, Contacts as Found, Scene
from ._coupling import Detector
from ._mujoco_model import Geoms, Integer, Parameters, Properties, Solref, checked_solref, combine, mj, stiffness
from ._native import fill_mujoco_contacts

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .bodies import DetectOptions


class Contacts:
    """Finds the contacts between geoms of a model, and gives them to MuJoCo's solver.

    geoms: for the names of mesh geoms, the assets that were encoded from the files of their meshes.
    A geom that is a plane, box, sphere, capsule or cylinder gets None in place of an asset. Contacts are
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

    def __init__(
        self,
        model: mj.MjModel,
        geoms: Mapping[str, Asset | None],
        *,
        solref: Solref = "rigid",
        **options: Unpack[DetectOptions],
    ) -> None:
        self._solref = checked_solref(solref)
        self._geoms = Geoms(model, geoms)
        self._ids = self._geoms.ids
        self._detector = Detector(self._geoms.shapes, np.zeros(len(geoms), int), self._geoms.excluded, options)

    @property
    def last(self) -> Found | None:
        """The contacts of the last detection, None before the first; instances are in the order of
        `geoms`."""
        return self._detector.last

    @property
    def scene(self) -> Scene:
        """A copy of the scene: the geoms as instances, in the order of `geoms`, at the poses of the
        last detection."""
        return self._detector.scene.__copy__()

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
        fill_mujoco_contacts(
            data.contact, before, found, self._ids, lambda first, second: self._parameters(model, first, second)
        )
        return count

    def detect(self, model: mj.MjModel, data: mj.MjData) -> Found:
        """Finds contacts at the positions and velocities of `data`, without adding them."""
        moved = np.zeros((len(self._ids), 6))
        for row, geom in zip(moved, self._ids):
            mj.mj_objectVelocity(model, data, mj.mjtObj.mjOBJ_GEOM, geom, row, 0)
        if not model.opt.disableflags & mj.mjtDisableBit.mjDSBL_GRAVITY:
            # What falls from rest must not pass the other body within the step.
            moved[self._geoms.moves, 3:] += model.opt.gravity * model.opt.timestep
        return self._detector.detect(
            data.geom_xmat[self._ids], data.geom_xpos[self._ids], moved[:, 3:], moved[:, :3], model.opt.timestep
        )

    def _parameters(self, model: mj.MjModel, first: Integer, second: Integer) -> Parameters:
        """The parameters of contacts between two geoms, a row for each pair."""
        of_geoms = Properties(
            model.geom_priority,
            model.geom_condim,
            model.geom_solmix,
            model.geom_friction,
            model.geom_solref,
            model.geom_solimp,
        )
        combined = combine(of_geoms, first, second)
        if model.opt.enableflags & mj.mjtEnableBit.mjENBL_OVERRIDE:
            count = (len(first), 1)
            combined = Parameters(
                combined.condim,
                np.tile(model.opt.o_friction, count),
                np.tile(model.opt.o_solref, count),
                np.tile(model.opt.o_solimp, count),
            )
        return stiffness(self._solref, model.opt.timestep, combined)
