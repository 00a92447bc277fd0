"""Contacts and instances as arrays: one array for each field, and a row for each contact or
instance. `len` is the number of rows.

Where all arrays have these rows, `contacts[0]` is a named tuple of one row, `contacts[mask]` has some of
them, and `for contact in contacts` goes over them. `to_dict()` and `to_dataframe()` have a column for
each number.

Points, normals and lengths are in the frame and unit of the world.
"""

from __future__ import annotations

import collections
import dataclasses
import functools
import html
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _html
from .reports import DetectionStatistics

if TYPE_CHECKING:
    from ._native import DeviceArray

_Float = npt.NDArray[np.float64]
_Id = npt.NDArray[np.uint32]


class _Rows:
    def __len__(self) -> int:
        first = dataclasses.fields(self)[0]  # type: ignore[arg-type]
        return len(getattr(self, first.name))

    def __repr__(self) -> str:
        return f"<tesdf.{type(self).__name__}: {len(self)} rows>"


class _Table(_Rows):
    """All arrays have the same number of rows."""

    def arrays(self) -> dict[str, npt.NDArray[Any]]:
        """The arrays with a value for each row, by name, as for `numpy.savez`."""
        fields = (field.name for field in dataclasses.fields(self))  # type: ignore[arg-type]
        named = {name: getattr(self, name) for name in fields}
        return {name: array for name, array in named.items() if isinstance(array, np.ndarray)}

    def __getitem__(self, rows: Any) -> Any:
        """A named tuple of one row for an integer; for a slice, a mask or integers, these rows. What
        does not belong to a row, such as `statistics`, stays that of all."""
        arrays = self.arrays()
        if isinstance(rows, (int, np.integer)):
            return _row_class(type(self).__name__, tuple(arrays))(*(array[rows] for array in arrays.values()))
        rows = rows if isinstance(rows, slice) else np.asarray(rows)
        if not isinstance(rows, slice) and rows.size == 0 and rows.dtype.kind == "f":
            rows = rows.astype(int)  # numpy's type for an empty list
        chosen = {name: array[rows] for name, array in arrays.items()}
        return dataclasses.replace(self, **chosen)  # type: ignore[type-var]

    def __iter__(self) -> Iterator[Any]:
        row = _row_class(type(self).__name__, tuple(self.arrays()))
        return map(row._make, zip(*self.arrays().values()))

    def to_dict(self) -> dict[str, npt.NDArray[Any]]:
        """A column for each number of a row: `point_a_x`, `point_a_y`, `point_a_z`, `distance`, ….
        `pandas.DataFrame` and `polars.DataFrame` take it."""
        columns = {}
        for name, array in self.arrays().items():
            if array.ndim == 1:
                columns[name] = array
                continue
            ends = _ENDS.get(array.shape[1], tuple(map(str, range(array.shape[1]))))
            columns.update({f"{name}_{end}": array[:, k] for k, end in enumerate(ends)})
        return columns

    def to_dataframe(self) -> Any:
        """The columns of `to_dict` as a `pandas.DataFrame`; needs pandas."""
        try:
            import pandas
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError("to_dataframe needs pandas: pip install pandas", name=error.name) from error
        return pandas.DataFrame(self.to_dict())

    def _repr_html_(self) -> str:
        return _html.of_rows(self)


# Names of the numbers of vectors, poses and velocities.
_ENDS = {
    3: ("x", "y", "z"),
    6: ("vx", "vy", "vz", "wx", "wy", "wz"),
    7: ("x", "y", "z", "qx", "qy", "qz", "qw"),
}


@functools.cache
def _row_class(table: str, names: tuple[str, ...]) -> Any:
    return collections.namedtuple(f"{table}Row", names)  # type: ignore[misc]


@dataclass(frozen=True, eq=False, repr=False)
class Instances(_Table):
    """The states of the instances of a scene, in the order of their ids."""

    ids: _Id
    """[N]"""
    shape: _Id
    """[N] id of the shape"""
    poses: _Float
    """[N, 7] x y z qx qy qz qw"""
    velocities: _Float
    """[N, 6] vx vy vz wx wy wz"""
    scale: _Float
    """[N] world units for each unit of the shape"""
    world: _Id
    """[N]"""
    memberships: _Id
    """[N] the groups to which the instance belongs, as bits"""
    filter: _Id
    """[N] the groups that the instance meets, as bits"""


@dataclass(frozen=True, eq=False, repr=False)
class Reductions(_Table):
    """The loss from the reduction, a row for each pair of instances that touches.

    Take any normal forces on all contacts of a pair, with total size F. Normal forces on the kept
    contacts with the same total size can replace them. The sums of forces differ by at most
    `wrench_error` * F, the torques around `center` by at most `wrench_error` * `length` * F.
    """

    instance_a: _Id
    """[P] the lower id"""
    instance_b: _Id
    """[P] the higher id"""
    contacts: npt.NDArray[np.uint64]
    """[P] number of contacts before the reduction; with `spread`, of those found"""
    kept: npt.NDArray[np.uint64]
    """[P] number of kept contacts"""
    wrench_error: _Float
    """[P] without unit; 0 if all are kept"""
    center: _Float
    """[P, 3] centre of a box around the contact points"""
    length: _Float
    """[P] greatest distance of a contact point from `center`"""
    left_out_above: _Float
    """[P] no contact that was left out has a lower signed distance; NaN if all are kept, and with
    `reduce`"""


@dataclass(frozen=True, eq=False, repr=False)
class HiddenOverlaps(_Table):
    """Pairs of instances that overlap without a contact that shows it."""

    instance_a: _Id
    """[H] the lower id"""
    instance_b: _Id
    """[H] the higher id"""
    depth: _Float
    """[H] lower bound of the depth"""


@dataclass(frozen=True, eq=False, repr=False)
class CoarseContacts(_Table):
    """Faces that touch and that are large against the other body: the mode "node" can miss where
    they touch."""

    instance_a: _Id
    """[C] the body that has the face"""
    instance_b: _Id
    """[C] the body that it touches"""
    face_a: _Id
    """[C]"""
    corner_reach: _Float
    """[C] greatest distance of a point of the face from its nearest vertex"""
    distance: _Float
    """[C] least signed distance of the face"""


@dataclass(frozen=True, eq=False, repr=False)
class Clearances(_Table):
    """Signed distances of pairs of bodies, a row for each pair. `tesdf.Clearance` says more."""

    instance_a: _Id
    """[P]"""
    instance_b: _Id
    """[P]"""
    distance: _Float
    """[P] least distance between the surfaces; negative where the bodies overlap. At most the
    tolerance above the true value if `converged`"""
    lower_bound: _Float
    """[P] the true value is between this and `distance`"""
    point_a: _Float
    """[P, 3] witness point on a"""
    point_b: _Float
    """[P, 3] witness point on b"""
    normal: _Float
    """[P, 3] unit vector from b to a"""
    face_a: _Id
    """[P] face of a with the witness point"""
    face_b: _Id
    """[P] face of b with the witness point"""
    field: _Id
    """[P] the instance whose signed distance field was used"""
    converged: npt.NDArray[np.bool_]
    """[P] whether the error is within the tolerance"""
    overlap: npt.NDArray[np.bool_]
    """[P] whether the solids share volume, also where their surfaces coincide"""


@dataclass(frozen=True, eq=False, repr=False)
class Impacts(Clearances):
    """First impacts of pairs of moving bodies: the clearances at their times. Where the bodies stay
    apart until the end, `time` is inf, the numbers of the clearance NaN, and the ids 2^32 - 1."""

    time: _Float
    """[P] of the impact; NaN where it is undecided"""
    iterations: _Id
    """[P] the most steps that a pair of parts of the surfaces took"""
    touches: npt.NDArray[np.bool_]
    """[P] whether the bodies touch at `time`"""
    free_until: _Float
    """[P] before this time the bodies are apart"""
    decided: npt.NDArray[np.bool_]
    """[P] False where the steps were used up, or rounding is not small relative to the tolerance: what
    comes after `free_until` is not known, and the clearance is that at this time"""


@dataclass(frozen=True, eq=False, repr=False)
class ContactPatches(_Rows):
    """Regions in which two bodies touch, a row for each: sorted by instances, those of one pair by
    distance. Q is the number of all points, N that of the contacts."""

    id: npt.NDArray[np.uint64]
    """[P] stays the same as long as the region shares a face with that of the detection before; never
    used again"""
    age: npt.NDArray[np.uint64]
    """[P] number of updates since the patch appeared; 0 at its first one"""
    instance_a: _Id
    """[P] the lower id"""
    instance_b: _Id
    """[P] the higher id"""
    normal: _Float
    """[P, 3] mean unit normal, from b to a"""
    distance: _Float
    """[P] least signed distance"""
    area: _Float
    """[P] of the convex hull of the contacts, seen along the normal; 0 where they lie on a line"""
    center: _Float
    """[P, 3] pressure centre: the mean point of the hull, weighted by a pressure that grows with the
    depth"""
    patch_of_contact: _Id
    """[N] the row of each contact's patch"""
    point_patch: _Id
    """[Q] the rows of the patches that the points span, ascending; the first point of each is the
    deepest"""
    point_id: npt.NDArray[np.uint64]
    """[Q] stays the same as long as the point keeps its place on one of the two bodies"""
    point_contact: npt.NDArray[np.uint64]
    """[Q] the contact of each point"""
    ended: npt.NDArray[np.uint64]
    """ids of patches of the detection before that no longer touch, ascending"""


@dataclass(frozen=True, eq=False, repr=False)
class ContactRows(_Table):
    """Arrays with a row for each contact.

    In each contact, *a* is the body that has the face or vertex, and *b* is the body whose
    signed distance field is used. Faces are numbered as in the source mesh, from 0.
    """

    point_a: _Float
    """[N, 3] witness point on `face_a`"""
    point_b: _Float
    """[N, 3] the point of b's surface that is closest to `point_a`"""
    normal: _Float
    """[N, 3] unit vector from b to a: the gradient of b's signed distance at `point_a`, in the modes
    "face" and "exact" turned to a direction that both bodies allow"""
    distance: _Float
    """[N] signed distance of b at `point_a`; negative where the bodies overlap"""
    face_a: _Id
    """[N] face of a; of a vertex, the lowest face that has it"""
    face_b: _Id
    """[N] the face of b that is closest to `point_a`"""
    tet_b: _Id
    """[N] cell of b, as the index of its word in `sections["domain.nodes"]`; `NO_CELL` where the
    face tree or a formula answered"""
    instance_a: _Id
    """[N] the body that has the face"""
    instance_b: _Id
    """[N] the body whose field is used"""
    feature_a: _Id
    """[N] face of a; in the mode "node", vertex of a"""
    feature_b_kind: npt.NDArray[np.uint8]
    """[N] the closest feature of b: 0 for a vertex, 1 for an edge, 2 for a face"""
    feature_b: _Id
    """[N, 2] the vertex or face in the first column, or the two vertices of the edge, the lower id
    first; the unused number is 2^32 - 1. `Scene.touching_features` also names the vertex or edge of
    a"""
    converged: npt.NDArray[np.bool_]
    """[N] whether it is proved that no point of the face is deeper by more than the tolerance"""


@dataclass(frozen=True, eq=False, repr=False)
class Contacts(ContactRows):
    """The contacts of a scene, sorted by world, instances, face and cell."""

    statistics: DetectionStatistics
    """of the whole detection"""
    reductions: Reductions
    """for each pair of instances; without rows if nothing is reduced"""
    hidden: HiddenOverlaps
    """pairs that overlap without a contact that shows it; contacts will not keep them apart. This
    happens in the mode "node", and for bodies in the same pose"""

    def __repr__(self) -> str:
        overlaps = f", {len(self.hidden)} hidden overlaps" if len(self.hidden) else ""
        return f"<tesdf.Contacts: {len(self)} contacts{overlaps}>"


@dataclass(frozen=True, eq=False, repr=False)
class TouchingFeatures(_Table):
    """The vertices, edges or faces of two bodies that touch, a row for each contact:
    `Scene.touching_features`."""

    a_kind: npt.NDArray[np.uint8]
    """[N] 0 for a vertex, 1 for an edge, 2 for a face of a"""
    a: _Id
    """[N, 2] the vertex or face in the first column, or the two vertices of the edge, the lower id
    first; the unused number is 2^32 - 1"""
    b_kind: npt.NDArray[np.uint8]
    """[N] likewise of b"""
    b: _Id
    """[N, 2] likewise of b"""


@dataclass(frozen=True, eq=False, repr=False)
class DeviceContacts(_Rows):
    """Contacts on a device, sorted by world and instances. numpy() of an array copies it; on a CUDA
    device other libraries use it in place."""

    point_a: DeviceArray
    """[N, 3] float32, witness point on the surface of a"""
    point_b: DeviceArray
    """[N, 3] float32, the point of b's surface that is closest to it"""
    normal: DeviceArray
    """[N, 3] float32, unit vector from b to a: that of `detect`"""
    distance: DeviceArray
    """[N] float32, signed distance of b; negative where the bodies overlap"""
    instances: DeviceArray
    """[N, 2] uint32, the ids of a, which has the surface, and of b, whose field is used"""
    hidden: HiddenOverlaps
    """pairs that overlap without a contact that shows it"""

    def __len__(self) -> int:
        return len(self.distance)


@dataclass(frozen=True, eq=False, repr=False)
class StepContacts(ContactRows):
    """The contacts at the beginning of a step of a simulation. Instances are the bodies."""

    hidden: HiddenOverlaps
    """pairs that overlap without a contact that shows it"""


@dataclass(frozen=True, eq=False, repr=False)
class ContactForces(_Table):
    """The forces between bodies at the contacts of a step, each the mean over the step."""

    bodies: _Id
    """[N, 2] the force acts on the first body, and its opposite on the second"""
    points: _Float
    """[N, 3] m"""
    normals: _Float
    """[N, 3] out of the second body"""
    normal_forces: _Float
    """[N] force along the normal, N"""
    frictions: _Float
    """[N, 3] force across the normal on the first body, N"""
    torques: _Float
    """[N] moment of torsional friction about the normal on the first body, N m"""

    @property
    def forces(self) -> _Float:
        """[N, 3] the whole force on the first body, N"""
        return self.normal_forces[:, None] * self.normals + self.frictions

    def on(self, body: int) -> _Float:
        """The sum [3] of the forces on a body, N."""
        sign = (self.bodies == body) @ np.array([1.0, -1.0])
        return np.asarray(sign @ self.forces)


@dataclass(frozen=True, eq=False, repr=False)
class JointForces(_Table):
    """What each of J joints did to its child in a step, as the mean over the step. To its parent, it
    did the opposite. Forces and torques are with those of motors and couplings."""

    forces: _Float
    """[J, 3] N"""
    torques: _Float
    """[J, 3] about the joint's anchor, N m"""
    motors: _Float
    """[J] torque of the motor of a hinge, N m, or force of that of a slider, N"""
    couplings: _Float
    """[J] likewise of the couplings with other joints"""


@dataclass(frozen=True, eq=False, repr=False)
class Record(_Rows):
    """The states of B bodies after 0 to S steps of a simulation, and R recorded contacts. A notebook plays
    it, and `tesdf.view` and `tesdf.export` take it."""

    times: _Float
    """[S + 1] s"""
    poses: _Float
    """[S + 1, B, 7] x y z qx qy qz qw, m"""
    velocities: _Float
    """[S + 1, B, 6] of the centre of mass, m/s, and angular, rad/s"""
    contact_steps: npt.NDArray[np.uint64]
    """the steps whose contacts are recorded, also those without a contact"""
    steps: npt.NDArray[np.uint64]
    """[R] the step at whose beginning the contact was found"""
    points: npt.NDArray[np.float32]
    """[R, 3] `point_a`, m"""
    normals: npt.NDArray[np.float32]
    """[R, 3] from b to a"""
    distances: npt.NDArray[np.float32]
    """[R] signed distance, m"""
    bodies: _Id
    """[R, 2] the body of the face, and the body of the field"""
    faces: _Id
    """[R, 2] face of a, and face of b"""
    force_steps: npt.NDArray[np.uint64]
    """[Q] the steps whose forces are recorded (`forces_every`)"""
    contact_force_steps: npt.NDArray[np.uint64]
    """[F] the step of each contact force"""
    contact_forces: ContactForces
    """F forces between bodies"""
    joint_forces: JointForces
    """Q · J forces of joints, those of a step together"""
    warnings: list[dict[str, Any]]
    """what the steps did not do as the scene asks, as `warnings` of `summary()`"""
    # The run with the meshes of its bodies, of the compiled module.
    _run: object = None

    def _repr_html_(self) -> str:
        from .playback import _of_notebook

        return f"<p>{html.escape(repr(self))}</p>" if self._run is None else _of_notebook(self, "record")

    def __getstate__(self) -> dict[str, Any]:
        # A copy in another process has the arrays alone.
        return {**vars(self), "_run": None}
