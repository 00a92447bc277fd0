"""What the couplings to physics engines share: shapes at the poses and velocities of the engine."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._native import Asset, DeviceArray, Scene
from .bodies import Shape
from .contacts import Contacts as Found, DeviceContacts

Float = npt.NDArray[np.float64]

# The bits of shapes with an asset and of simple shapes. The engine finds the contacts of two simple ones.
_ASSETS, _SIMPLE = 1, 2

# Impedance of a contact with the stiffness "rigid": the share of the constraint that is enforced. A
# higher one makes the nut of the tests neither faster nor its overlaps smaller.
_IMPEDANCE = 0.9

RIGID_SOLIMP = (_IMPEDANCE, _IMPEDANCE, 1e-3, 0.5, 2.0)
"""solimp of MuJoCo with `rigid_solref`"""

# Contacts are found as far ahead as motion can close in this many time steps.
_STEPS_AHEAD = 1.2


@dataclass(frozen=True)
class Placed:
    """A shape of the engine: what it is here, and the pose of its frame in the frame of the engine."""

    shape: Shape
    scale: float
    rotation: Float
    """[3, 3]"""
    translation: Float
    """[3]"""


class Detector:
    """Finds the contacts of shapes, each in its world. Shape i is the instance i of the scene.

    The default mode is "node", the default contact distance 0.5 % of the smallest diagonal of an
    asset. `excluded` has pairs of shapes that do not meet.
    """

    scene: Scene
    last: Found | None
    last_on_device: DeviceContacts | None

    def __init__(
        self,
        shapes: Sequence[Placed],
        world: npt.NDArray[Any],
        excluded: Iterable[tuple[int, int]],
        options: Mapping[str, Any],
    ) -> None:
        self.last = self.last_on_device = None
        self._poses: Any = None
        # The number of the device in CUDA, -1 for another one; None is not known yet.
        self._number: int | None = None
        self._rotations = np.array([shape.rotation for shape in shapes])
        self._translations = np.array([shape.translation for shape in shapes])
        self._options: dict[str, Any] = {"mode": "node", **options}
        if "contact_distance" not in options:
            self._options["contact_distance"] = 5e-3 * min(
                shape.scale * float(np.linalg.norm(np.diff(shape.shape.bounds, axis=0)))
                for shape in shapes
                if isinstance(shape.shape, Asset)
            )
        self.scene = Scene()
        ids: dict[int, int] = {}
        for shape in shapes:
            key = id(shape.shape)
            if key not in ids:
                ids[key] = self.scene.add_shape(shape.shape)
        groups = np.array([_ASSETS if isinstance(shape.shape, Asset) else _SIMPLE for shape in shapes])
        self.scene.add_many(
            [ids[id(shape.shape)] for shape in shapes],
            np.tile([0.0, 0, 0, 0, 0, 0, 1], (len(shapes), 1)),
            scale=[shape.scale for shape in shapes],
            world=world,
            memberships=groups,
            filter=np.where(groups == _SIMPLE, _ASSETS, _ASSETS | _SIMPLE),
        )
        pairs = np.array(list(excluded), dtype=np.uint32).reshape(-1, 2)
        if len(pairs):
            self.scene.exclude(pairs)

    def detect(
        self, rotations: Float, positions: Float, linear: Float, angular: Float, time_step: float
    ) -> Found:
        """Finds contacts. Each array has a row for each shape: the rotation [3, 3] and position of
        the engine's frame, and its linear and angular velocity, in the world's frame."""
        rotations, angular = rotations.reshape(-1, 3, 3), angular.reshape(-1, 3)
        arms = np.einsum("nij,nj->ni", rotations, self._translations)
        poses = np.zeros((len(arms), 4, 4))
        poses[:, :3, :3] = rotations @ self._rotations
        poses[:, :3, 3] = positions.reshape(-1, 3) + arms
        poses[:, 3, 3] = 1.0
        velocities = np.hstack([linear.reshape(-1, 3) + np.cross(angular, arms), angular])
        self.scene.update(np.arange(len(arms), dtype=np.uint32), poses=poses, velocities=velocities)
        found = self.scene.detect(**{"speculative_time": _STEPS_AHEAD * time_step, **self._options})
        self.last, self.last_on_device = found, None
        return found

    def leaves_on(self, cuda: int | None) -> bool:
        """Whether contacts can stay on this CUDA device, given by its number, which is that of the engine:
        they are found there, in a form that needs no processor."""
        if cuda is None or self._options.get("device") in (None, "cpu"):
            return False
        if self._number is None:
            self._number = _cuda_number(self._options["device"])
        options = self._options
        per_cell = options["mode"] == "node" or options.get("contacts_per") == "cell"
        reduces = options.get("reduce") is not None or options.get("spread") is not None
        return self._number == cuda and options.get("contacts_per") != "minimum" and (per_cell or reduces)

    def detect_on_device(self, poses: Any, velocities: Any, time_step: float) -> DeviceContacts:
        """Finds contacts where they stay, by arrays there: poses [N, 7], velocities [N, 6] of the shapes'
        own frames."""
        options = {"speculative_time": _STEPS_AHEAD * time_step, **self._options}
        found = self.scene.detect_on_device(poses=poses, velocities=velocities, **options)
        self.last, self.last_on_device, self._poses = None, found, poses
        return found

    def scene_now(self) -> Scene:
        """A copy of the scene at the poses of the last detection."""
        scene = self.scene.__copy__()
        if self.last_on_device is not None:
            poses = self._poses.numpy().astype(np.float64)
            poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
            scene.update(np.arange(len(poses), dtype=np.uint32), poses=poses)
        return scene


def _cuda_number(device: str | int) -> int:
    try:
        return DeviceArray(np.zeros(1, np.float32), device).__dlpack_device__()[1]
    except BufferError:
        return -1


def kinds_of(rows: npt.NDArray[Any]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The distinct rows [K, W] of numbers that are not negative, sorted, and for each row its place among them.
    As `numpy.unique(rows, axis=0)`, which takes ten times as long: it sorts rows as bytes."""
    rows = rows.astype(np.int64)
    sizes = rows.max(axis=0, initial=0) + 1
    _, first, kind = np.unique(np.ravel_multi_index(tuple(rows.T), tuple(sizes)), return_index=True, return_inverse=True)
    return rows[first], kind.reshape(-1)


def rigid_solref(time_step: Float) -> Float:
    """[..., 2], the solref of MuJoCo with which a gap closes within one time step, and not sooner, and an
    overlap of one is gone in the next."""
    return -_IMPEDANCE * np.stack([time_step**-2.0, time_step**-1.0], -1)


def check_bounds(label: str, of_mesh: Float, of_asset: Float, hint: str) -> None:
    """Raises ValueError if the bounds [2, 3] of the engine's mesh are not those of the asset."""
    if np.abs(of_mesh - of_asset).max() > 1e-5 * np.linalg.norm(np.ptp(of_mesh, axis=0)):
        raise ValueError(f"{label}: its mesh spans {of_mesh.tolist()}, but the asset {of_asset.tolist()}; {hint}")
