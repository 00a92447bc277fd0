from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, Protocol, Union, final, overload

import numpy as np
import numpy.typing as npt

from .bodies import Body, Mesh, Shape
from .contacts import (
    Clearances,
    CoarseContacts,
    ContactForces,
    ContactPatches,
    ContactRows,
    Contacts,
    DeviceContacts,
    Impacts,
    Instances,
    JointForces,
    Record,
    StepContacts,
    TouchingFeatures,
)
from .playback import LiveView
from .reports import (
    Certificate,
    CheckReport,
    Clearance,
    Device,
    Impact,
    Inspection,
    Source,
    Statistics,
    VerifyReport,
    WhyReport,
)
from .results import Answers, DeviceAnswers, Moved, RayHits, Reencoded, Repaired

class _ContactParameters(Protocol):
    @property
    def condim(self) -> npt.NDArray[Any]: ...
    @property
    def friction(self) -> npt.NDArray[Any]: ...
    @property
    def solref(self) -> npt.NDArray[Any]: ...
    @property
    def solimp(self) -> npt.NDArray[Any]: ...

_Path = Union[str, PathLike[str]]
_Precision = Literal["f64", "f32"]
_Numbers = Union[float, npt.ArrayLike]
_Integers = Union[int, npt.ArrayLike]

_Device = Union[str, int, None]

__all__ = [
    "NO_CELL",
    "NO_FACE",
    "Asset",
    "DeviceArray",
    "InstancePairs",
    "PatchTracker",
    "Scene",
    "Simulation",
    "Snapshot",
    "Worlds",
    "__version__",
    "asset_of",
    "check",
    "contact_frames",
    "devices",
    "encode",
    "export",
    "fill_mujoco_contacts",
    "pair",
    "polygons",
    "pose",
    "repair",
    "view",
]

NO_CELL: int
NO_FACE: int
__version__: str

def polygons(
    points: npt.ArrayLike, counts: npt.ArrayLike, corners: npt.ArrayLike
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32], tuple[str, ...]]: ...
def pose(name: str, pose: npt.ArrayLike) -> list[float]: ...
def asset_of(mesh: Mesh) -> Asset: ...
def check(mesh: Mesh) -> CheckReport: ...
def contact_frames(normals: npt.ArrayLike) -> npt.NDArray[np.float64]: ...
def fill_mujoco_contacts(
    fields: Any,
    start: int,
    contacts: ContactRows,
    geoms: npt.ArrayLike,
    parameters: Callable[[npt.NDArray[np.int64], npt.NDArray[np.int64]], _ContactParameters],
) -> None: ...
def devices() -> list[Device]: ...
def repair(
    mesh: Mesh,
    *,
    weld_tolerance: float | Literal["auto"] | None = None,
    orient: bool = False,
    fill_holes: bool | int | None = None,
) -> Repaired: ...
def encode(
    mesh: Mesh,
    preset: Literal["default", "fast", "compact", "gpu", "paper", "sampled-safe"] = "default",
    *,
    domain: Literal["bisection", "gmsh"] | _Path | None = None,
    encoder: Literal["certified", "sampled"] | None = None,
    resolution: int | None = None,
    threshold: float | Literal["safe"] | None = None,
    e_max: int | None = None,
    deformable: bool = False,
    plain: bool = False,
    band: float | None = None,
    regions: Sequence[Sequence[float]] | None = None,
    unit: str | None = None,
    inside: Literal["winding", "nonzero", "odd", "generalized", "sheet"] = "winding",
    thickness: float | None = None,
    surface: Literal["all", "boundary"] = "all",
    repair: Literal["auto"] | None = None,
    threads: int | None = None,
    progress: Callable[[str, float], object] | None = None,
) -> Asset: ...
@final
class Asset:
    @staticmethod
    def open(path: _Path) -> Asset: ...
    @staticmethod
    def from_bytes(data: bytes) -> Asset: ...
    def to_bytes(self) -> bytes: ...
    def save(self, path: _Path) -> None: ...
    @overload
    def query(self, points: DeviceArray, precision: _Precision = "f64", *, device: _Device = "cpu") -> DeviceAnswers: ...
    @overload
    def query(self, points: npt.ArrayLike, precision: _Precision = "f64", *, device: _Device = "cpu") -> Answers: ...
    def query_in_domain(self, points: npt.ArrayLike, precision: _Precision = "f64") -> Answers: ...
    def signed_distance(self, points: npt.ArrayLike, precision: _Precision = "f64") -> npt.NDArray[np.float64]: ...
    def is_inside(self, points: npt.ArrayLike) -> npt.NDArray[np.bool_]: ...
    def ray_cast(self, origins: npt.ArrayLike, directions: npt.ArrayLike, limit: float = ...) -> RayHits: ...
    def move_vertices(self, vertices: npt.ArrayLike, positions: npt.ArrayLike) -> Moved: ...
    def stale_cells(self) -> npt.NDArray[np.uint32]: ...
    def reencode_stale(self) -> Reencoded: ...
    def inspect(self) -> Inspection: ...
    def verify(self, samples: int = 10_000) -> VerifyReport: ...
    @property
    def certificate(self) -> Certificate: ...
    @property
    def statistics(self) -> Statistics: ...
    @property
    def source(self) -> Source: ...
    @property
    def unit(self) -> str | None: ...
    @property
    def bounds(self) -> npt.NDArray[np.float64]: ...
    @property
    def vertices(self) -> npt.NDArray[np.float64]: ...
    @property
    def faces(self) -> npt.NDArray[np.uint32]: ...
    @property
    def face_ids(self) -> npt.NDArray[np.uint32]: ...
    @property
    def sections(self) -> dict[str, npt.NDArray[Any]]: ...
    def __reduce__(self) -> tuple[Callable[[bytes], Asset], tuple[bytes]]: ...
@final
class Scene:
    def __new__(cls) -> Scene: ...
    def add_shape(self, shape: Body) -> int: ...
    def remove_shape(self, shape: int) -> None: ...
    def add(
        self,
        shape: int,
        pose: npt.ArrayLike | None = None,
        *,
        velocity: npt.ArrayLike | None = None,
        scale: float = 1.0,
        world: int = 0,
        memberships: int = 0xFFFFFFFF,
        filter: int = 0xFFFFFFFF,
    ) -> int: ...
    def add_many(
        self,
        shape: _Integers,
        poses: npt.ArrayLike,
        *,
        velocities: npt.ArrayLike | None = None,
        scale: _Numbers = 1.0,
        world: _Integers = 0,
        memberships: _Integers = 0xFFFFFFFF,
        filter: _Integers = 0xFFFFFFFF,
    ) -> npt.NDArray[np.uint32]: ...
    def update(
        self,
        ids: npt.ArrayLike,
        *,
        poses: npt.ArrayLike | None = None,
        velocities: npt.ArrayLike | None = None,
        scale: _Numbers | None = None,
        world: _Integers | None = None,
        memberships: _Integers | None = None,
        filter: _Integers | None = None,
    ) -> None: ...
    def remove(self, ids: npt.ArrayLike) -> None: ...
    def exclude(self, pairs: npt.ArrayLike) -> None: ...
    def include(self, pairs: npt.ArrayLike) -> None: ...
    @property
    def excluded(self) -> npt.NDArray[np.uint32]: ...
    @property
    def shapes(self) -> dict[int, Shape]: ...
    @property
    def instances(self) -> Instances: ...
    def detect(
        self,
        *,
        mode: Literal["node", "face", "exact"] = "exact",
        contacts_per: Literal["cell", "face", "minimum"] = "face",
        contact_distance: float = 0.0,
        speculative_time: float = 0.0,
        cos_theta: float | None = None,
        iterations: int | None = None,
        tolerance: float | None = None,
        reduce: int | None = None,
        spread: int | None = None,
        precision: _Precision = "f64",
        threads: int | None = None,
        device: _Device = "cpu",
    ) -> Contacts: ...
    def detect_on_device(
        self,
        *,
        poses: Any = None,
        velocities: Any = None,
        device: _Device = None,
        mode: Literal["node", "face", "exact"] = "exact",
        contacts_per: Literal["cell", "face", "minimum"] = "face",
        contact_distance: float = 0.0,
        speculative_time: float = 0.0,
        cos_theta: float | None = None,
        iterations: int | None = None,
        tolerance: float | None = None,
        reduce: int | None = None,
        spread: int | None = None,
        precision: _Precision = "f64",
        threads: int | None = None,
    ) -> DeviceContacts: ...
    def coarse_contacts(
        self,
        *,
        mode: Literal["node", "face", "exact"] = "exact",
        contacts_per: Literal["cell", "face", "minimum"] = "face",
        contact_distance: float = 0.0,
        speculative_time: float = 0.0,
        cos_theta: float | None = None,
        iterations: int | None = None,
        tolerance: float | None = None,
        reduce: int | None = None,
        spread: int | None = None,
        precision: _Precision = "f64",
        threads: int | None = None,
    ) -> CoarseContacts: ...
    def touching_features(self, contacts: ContactRows) -> TouchingFeatures: ...
    def clearance(self, a: int, b: int, *, tolerance: float | None = None) -> Clearance: ...
    def clearances(self, pairs: npt.ArrayLike, *, tolerance: float | None = None) -> Clearances: ...
    def times_of_impact(
        self,
        pairs: npt.ArrayLike,
        *,
        velocities_a: npt.ArrayLike | None = None,
        velocities_b: npt.ArrayLike | None = None,
        screws_a: npt.ArrayLike | None = None,
        screws_b: npt.ArrayLike | None = None,
        end: float = 1.0,
        tolerance: float | None = None,
        iterations: int = 1000,
    ) -> Impacts: ...
    def time_of_impact(
        self,
        a: int,
        b: int,
        *,
        velocity_a: npt.ArrayLike | None = None,
        velocity_b: npt.ArrayLike | None = None,
        screw_a: npt.ArrayLike | None = None,
        screw_b: npt.ArrayLike | None = None,
        end: float = 1.0,
        tolerance: float | None = None,
        iterations: int = 1000,
    ) -> Impact | None: ...
    def why(
        self,
        a: int,
        b: int,
        part: int | None = None,
        *,
        mode: Literal["node", "face", "exact"] = "exact",
        contacts_per: Literal["cell", "face", "minimum"] = "face",
        contact_distance: float = 0.0,
        speculative_time: float = 0.0,
        cos_theta: float | None = None,
        iterations: int | None = None,
        tolerance: float | None = None,
        reduce: int | None = None,
        spread: int | None = None,
        precision: _Precision = "f64",
        threads: int | None = None,
    ) -> WhyReport: ...
    def __len__(self) -> int: ...
    def __copy__(self) -> Scene: ...

@final
class DeviceArray:
    def __new__(cls, array: npt.ArrayLike, device: _Device = "gpu") -> DeviceArray: ...
    def numpy(self) -> npt.NDArray[Any]: ...
    @property
    def device(self) -> str: ...
    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...
    @property
    def __cuda_array_interface__(self) -> dict[str, Any]: ...
    def __dlpack__(
        self,
        *,
        stream: Any = None,
        max_version: tuple[int, int] | None = None,
        dl_device: tuple[int, int] | None = None,
        copy: bool | None = None,
    ) -> Any: ...
    def __dlpack_device__(self) -> tuple[int, int]: ...
    def __len__(self) -> int: ...

@final
class InstancePairs:
    def __new__(cls) -> InstancePairs: ...
    def detect(
        self,
        scene: Scene,
        *,
        moved: npt.ArrayLike | None = None,
        mode: Literal["node", "face", "exact"] = "exact",
        contacts_per: Literal["cell", "face", "minimum"] = "face",
        contact_distance: float = 0.0,
        speculative_time: float = 0.0,
        cos_theta: float | None = None,
        iterations: int | None = None,
        tolerance: float | None = None,
        reduce: int | None = None,
        spread: int | None = None,
        precision: _Precision = "f64",
        threads: int | None = None,
    ) -> Contacts: ...
    @property
    def pairs(self) -> npt.NDArray[np.uint32]: ...

@final
class PatchTracker:
    def __new__(
        cls, *, angle: float = 0.5235987755982988, link: float | None = None, points: int = 4
    ) -> PatchTracker: ...
    def update(self, scene: Scene, contacts: ContactRows) -> ContactPatches: ...

@final
class Simulation:
    def __new__(
        cls,
        scene: _Path | dict[str, Any],
        *,
        mode: Literal["node", "face", "exact", "off"] | None = None,
        time_step: float | None = None,
        duration: float | None = None,
        threads: int | None = None,
        device: _Device = "cpu",
        history: bool = True,
    ) -> Simulation: ...
    def step(self, count: int = 1) -> None: ...
    def run(self, *, progress: Callable[[int, int], object] | None = None) -> dict[str, Any]: ...
    def summary(self) -> dict[str, Any]: ...
    def save(self, path: _Path) -> None: ...
    def record(self) -> Record: ...
    def view(self, *, title: str = "simulation") -> LiveView: ...
    def set_motor(
        self,
        joint: str | int,
        *,
        velocity: float | None = None,
        position: float | None = None,
        force: float | None = None,
        spring: Sequence[float] | None = None,
        limit: float = ...,
    ) -> None: ...
    def set_wrench(self, body: str | int, *, force: Sequence[float] = ..., torque: Sequence[float] = ...) -> None: ...
    def set_state(
        self, body: str | int, *, pose: npt.ArrayLike | None = None, velocity: npt.ArrayLike | None = None
    ) -> None: ...
    def set_mass(
        self,
        body: str | int,
        mass: float,
        *,
        center_of_mass: Sequence[float] | None = None,
        inertia: Sequence[float] | None = None,
    ) -> None: ...
    def set_friction(self, body: str | int, coefficient: float) -> None: ...
    def set_gravity(self, gravity: Sequence[float]) -> None: ...
    def reset(self, *, poses: npt.ArrayLike | None = None, velocities: npt.ArrayLike | None = None) -> None: ...
    def snapshot(self) -> Snapshot: ...
    def restore(self, snapshot: Snapshot) -> None: ...
    def copy(self) -> Simulation: ...
    def __copy__(self) -> Simulation: ...
    @property
    def masses(self) -> npt.NDArray[np.float64]: ...
    @property
    def frictions(self) -> npt.NDArray[np.float64]: ...
    @property
    def gravity(self) -> npt.NDArray[np.float64]: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def bodies(self) -> list[str]: ...
    @property
    def time(self) -> float: ...
    @property
    def steps(self) -> int: ...
    @property
    def planned_steps(self) -> int: ...
    @property
    def joints(self) -> list[str]: ...
    @property
    def coordinates(self) -> npt.NDArray[np.float64]: ...
    @property
    def coordinate_rates(self) -> npt.NDArray[np.float64]: ...
    @property
    def contact_forces(self) -> ContactForces: ...
    @property
    def joint_forces(self) -> JointForces: ...
    @property
    def poses(self) -> npt.NDArray[np.float64]: ...
    @property
    def velocities(self) -> npt.NDArray[np.float64]: ...
    @property
    def contacts(self) -> StepContacts: ...

@final
class Snapshot:
    def __len__(self) -> int: ...

@final
class Worlds:
    def __new__(
        cls,
        scene: _Path | dict[str, Any],
        count: int,
        *,
        mode: Literal["node", "face", "exact", "off"] | None = None,
        time_step: float | None = None,
        threads: int | None = None,
    ) -> Worlds: ...
    def step(self, count: int = 1) -> None: ...
    def reset(
        self,
        worlds: npt.ArrayLike | None = None,
        *,
        poses: npt.ArrayLike | None = None,
        velocities: npt.ArrayLike | None = None,
    ) -> None: ...
    def snapshot(self, worlds: npt.ArrayLike | None = None) -> Snapshot: ...
    def restore(self, snapshot: Snapshot, worlds: npt.ArrayLike | None = None) -> None: ...
    def copy(self) -> Worlds: ...
    def __copy__(self) -> Worlds: ...
    def set_mass(
        self,
        body: str | int,
        mass: _Numbers,
        *,
        center_of_mass: npt.ArrayLike | None = None,
        inertia: npt.ArrayLike | None = None,
        worlds: npt.ArrayLike | None = None,
    ) -> None: ...
    def set_friction(self, body: str | int, coefficient: _Numbers, *, worlds: npt.ArrayLike | None = None) -> None: ...
    def set_gravity(self, gravity: npt.ArrayLike, *, worlds: npt.ArrayLike | None = None) -> None: ...
    def set_motor(
        self,
        joint: str | int,
        *,
        velocity: _Numbers | None = None,
        position: _Numbers | None = None,
        force: _Numbers | None = None,
        spring: npt.ArrayLike | None = None,
        limit: _Numbers = ...,
        worlds: npt.ArrayLike | None = None,
    ) -> None: ...
    def set_wrench(
        self,
        body: str | int,
        *,
        force: npt.ArrayLike | None = None,
        torque: npt.ArrayLike | None = None,
        worlds: npt.ArrayLike | None = None,
    ) -> None: ...
    def set_state(
        self,
        body: str | int,
        *,
        pose: npt.ArrayLike | None = None,
        velocity: npt.ArrayLike | None = None,
        worlds: npt.ArrayLike | None = None,
    ) -> None: ...
    def contact_forces(self, world: int) -> ContactForces: ...
    def contacts(self, world: int) -> StepContacts: ...
    @property
    def bodies(self) -> list[str]: ...
    @property
    def joints(self) -> list[str]: ...
    @property
    def time_step(self) -> float: ...
    @property
    def times(self) -> npt.NDArray[np.float64]: ...
    @property
    def steps(self) -> npt.NDArray[np.uint64]: ...
    @property
    def poses(self) -> npt.NDArray[np.float64]: ...
    @property
    def velocities(self) -> npt.NDArray[np.float64]: ...
    @property
    def coordinates(self) -> npt.NDArray[np.float64]: ...
    @property
    def coordinate_rates(self) -> npt.NDArray[np.float64]: ...
    @property
    def net_contact_forces(self) -> npt.NDArray[np.float64]: ...
    @property
    def joint_forces(self) -> JointForces: ...
    @property
    def masses(self) -> npt.NDArray[np.float64]: ...
    @property
    def frictions(self) -> npt.NDArray[np.float64]: ...
    @property
    def gravity(self) -> npt.NDArray[np.float64]: ...
    def __len__(self) -> int: ...

def export(
    run: _Path | Simulation,
    path: _Path,
    *,
    every: int | None = None,
    fps: float | None = None,
    speed: float = 1.0,
    geometries: Mapping[str, _Path] | None = None,
) -> None: ...
def view(
    run: _Path | Simulation,
    path: _Path,
    *,
    every: int | None = None,
    fps: float | None = None,
    contacts: int = 128,
    title: str | None = None,
    geometries: Mapping[str, _Path] | None = None,
) -> None: ...
def pair(a: Body, b: Body, pose_a: npt.ArrayLike | None, pose_b: npt.ArrayLike | None) -> Scene: ...
