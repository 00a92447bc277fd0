"""Simple shapes for scenes. Sizes are positive, in the unit of the shape."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Plane:
    """The half-space z <= 0. Its surface is the plane z = 0."""


@dataclass(frozen=True)
class Box:
    """A box centred on the origin."""

    half_extents: tuple[float, float, float]
    """half of the edge lengths along x, y and z"""


@dataclass(frozen=True)
class Sphere:
    """A sphere centred on the origin."""

    radius: float


@dataclass(frozen=True)
class Capsule:
    """All points within `radius` of the segment from -`half_height` to `half_height` on the z
    axis."""

    half_height: float
    """half of the length of the segment"""
    radius: float


@dataclass(frozen=True)
class Cylinder:
    """All points within `radius` of the z axis, between -`half_height` and `half_height`."""

    half_height: float
    """half of the length"""
    radius: float


SIMPLE = (Plane, Box, Sphere, Capsule, Cylinder)
"""the simple shapes, for isinstance"""
