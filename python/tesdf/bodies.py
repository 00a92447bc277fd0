"""Contacts, distance and time of impact of two bodies, without a scene of one's own."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypedDict, Union

from . import _native
from .contacts import Contacts
from .reports import Clearance, Impact, WhyReport
from .shapes import Box, Capsule, Cylinder, Plane, Sphere

if TYPE_CHECKING:
    import numpy.typing as npt
    from typing_extensions import Unpack

class HasVertices(Protocol):
    """A mesh, such as one of trimesh (with `faces`) or Open3D (with `triangles`)."""

    @property
    def vertices(self) -> Any: ...


class HasPoints(Protocol):
    """A mesh of pyvista."""

    @property
    def points(self) -> Any: ...


class HasVertex(Protocol):
    """A mesh of Open3D's tensors."""

    @property
    def vertex(self) -> Any: ...


HasMesh = Union[HasVertices, HasPoints, HasVertex]
Mesh = Union["_native.Asset", str, "PathLike[str]", tuple["npt.ArrayLike", "npt.ArrayLike"], HasMesh]
Shape = Union["_native.Asset", Plane, Box, Sphere, Capsule, Cylinder]
Body = Union[Shape, Mesh]


class WhyOptions(TypedDict, total=False):
    """Keywords of `Scene.detect` on the processor, which explains them."""

    mode: Literal["node", "face", "exact"]
    contacts_per: Literal["cell", "face", "minimum"]
    contact_distance: float
    speculative_time: float
    cos_theta: float | None
    iterations: int
    tolerance: float | None
    reduce: int | None
    spread: int | None
    precision: Literal["f64", "f32"]
    threads: int | None


class DetectOptions(WhyOptions, total=False):
    """Keywords of `Scene.detect`, which explains them."""

    device: str | int | None


def collide(
    a: Body,
    b: Body,
    *,
    pose_a: npt.ArrayLike | None = None,
    pose_b: npt.ArrayLike | None = None,
    **options: Unpack[DetectOptions],
) -> Contacts:
    """The contacts of two bodies, as the instances 0 and 1. As `tesdf collide A B`.

    A body is a `Plane`, `Box`, `Sphere`, `Capsule` or `Cylinder`, or a mesh as `signed_distance` takes it, which is
    encoded once. Its pose has seven numbers, x y z qx qy qz qw, or is a matrix [4, 4]; None is the
    identity. `Scene.detect` explains the options.
    """
    return _native.pair(a, b, pose_a, pose_b).detect(**options)


def clearance(
    a: Body,
    b: Body,
    pose_a: npt.ArrayLike | None = None,
    pose_b: npt.ArrayLike | None = None,
    *,
    tolerance: float | None = None,
) -> Clearance:
    """The signed distance between the surfaces of two bodies, with witness points.

    Bodies and poses are those of `collide`. tolerance: largest error, in the world's unit; None is
    1e-8 of the smaller diagonal.
    """
    return _native.pair(a, b, pose_a, pose_b).clearance(0, 1, tolerance=tolerance)


def time_of_impact(
    a: Body,
    b: Body,
    *,
    pose_a: npt.ArrayLike | None = None,
    pose_b: npt.ArrayLike | None = None,
    velocity_a: npt.ArrayLike | None = None,
    velocity_b: npt.ArrayLike | None = None,
    screw_a: npt.ArrayLike | None = None,
    screw_b: npt.ArrayLike | None = None,
    end: float = 1.0,
    tolerance: float | None = None,
    iterations: int = 1000,
) -> Impact | None:
    """The first time at which two moving bodies touch, or None.

    Bodies and poses are those of `collide`; `Scene.time_of_impact` explains the rest.
    """
    return _native.pair(a, b, pose_a, pose_b).time_of_impact(
        0,
        1,
        velocity_a=velocity_a,
        velocity_b=velocity_b,
        screw_a=screw_a,
        screw_b=screw_b,
        end=end,
        tolerance=tolerance,
        iterations=iterations,
    )


def why(
    a: Body,
    b: Body,
    part: int | None = None,
    *,
    pose_a: npt.ArrayLike | None = None,
    pose_b: npt.ArrayLike | None = None,
    **options: Unpack[WhyOptions],
) -> WhyReport:
    """Why contacts of the faces of *a* in the field of *b* exist or not.

    Bodies and poses are those of `collide`; `Scene.why` explains the rest.
    """
    return _native.pair(a, b, pose_a, pose_b).why(0, 1, part, **options)
