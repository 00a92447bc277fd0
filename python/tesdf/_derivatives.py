"""How the depth of overlapping bodies changes with their poses.

The depth is the greatest one of the surface of a body in the field of the other body. Where two edges cross, and deep
within a body, the deepest point is as near to several faces: on one of them alone, the surface would be deeper
beside it. The gradients n_i by the point at these faces then balance along the surface: g = Σ λ_i n_i has no part along
it, with λ ≥ 0 and Σ λ_i = 1 (the first-order condition of a least maximum). The distance changes by g · (δp_a − δp_b),
where g is the unit normal if one face is nearest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .shapes import Box, Capsule, Cylinder, Plane, Sphere

Array = npt.NDArray[np.float64]

# Directions around a point, evenly spread on a spiral.
_HEIGHT = (np.arange(100) + 0.5) / 50 - 1
_TURN = np.pi * (1 + 5**0.5) * np.arange(100)
_AROUND = np.stack([np.sqrt(1 - _HEIGHT**2) * np.cos(_TURN), np.sqrt(1 - _HEIGHT**2) * np.sin(_TURN), _HEIGHT], 1)


@dataclass
class Placed:
    """A body in the world."""

    shape: Any
    rotation: Array
    translation: Array
    scale: float

    def reach(self, tolerance: float | None) -> float:
        """How far from the deepest point its nearest faces are looked up, in the world's unit: it is found to about the
        tolerance of the depth; None is 1e-8 of the diagonal."""
        if isinstance(self.shape, Box):
            size = 2 * float(np.linalg.norm(self.shape.half_extents))
        elif isinstance(self.shape, (Plane, Sphere, Capsule)):
            return 0.0
        elif isinstance(self.shape, Cylinder):
            size = 2 * float(np.hypot(self.shape.half_height, self.shape.radius))
        else:
            size = float(np.linalg.norm(np.ptp(self.shape.bounds, axis=0)))
        diagonal = size * self.scale
        return max(1e-9 * diagonal, 100 * (1e-8 * diagonal if tolerance is None else tolerance))

    def gradients(self, point: Array, around: Array) -> Array:
        """The gradients [K, 3] of the signed distance at a point in or on the body, by the faces that are nearest to the
        points around it [K, 3]."""
        at, near = ((x - self.translation) @ self.rotation / self.scale for x in (point, around))
        return _gradients(self.shape, at, near) @ self.rotation.T


def _gradients(shape: Any, point: Array, around: Array) -> Array:
    if isinstance(shape, Plane):
        return np.tile([0.0, 0, 1], (len(around), 1))
    if isinstance(shape, (Sphere, Capsule)):
        half = shape.half_height if isinstance(shape, Capsule) else 0
        from_axis = around - np.clip(around[:, 2:], -half, half) * [0, 0, 1]
        return np.asarray(from_axis / np.linalg.norm(from_axis, axis=1, keepdims=True))
    if isinstance(shape, Cylinder):
        from_axis = around * [1, 1, 0]
        length = np.linalg.norm(from_axis, axis=1, keepdims=True)
        is_end = np.abs(around[:, 2:]) - shape.half_height > length - shape.radius
        return np.asarray(np.where(is_end, np.sign(around[:, 2:]) * [0, 0, 1], from_axis / np.maximum(length, 1e-300)))
    if isinstance(shape, Box):
        side = (np.abs(around) - shape.half_extents).argmax(1)
        return np.asarray(np.eye(3)[side] * np.sign(around))
    found = shape.query(around)
    between = found.closest_point - point
    length = np.linalg.norm(between, axis=1, keepdims=True)
    is_far = length > 10 * np.linalg.norm(around - point, axis=1, keepdims=True)
    return np.where(is_far, between / np.where(is_far, length, 1), found.gradient)


def along_surface(body: Placed, point: Array, reach: float) -> Array:
    """The directions [0 to 2, 3] in which the surface of a body goes on to both sides of a point on it."""
    outward = _distinct(body.gradients(point, point + reach * _AROUND))
    _, sizes, axes = np.linalg.svd(outward)
    return np.asarray(axes[np.count_nonzero(sizes > 1e-5) :])


def along_face(body: Placed, point: Array, row: int, reach: float) -> Array:
    """As `along_surface`, of a single face, in its row of `Asset.faces`."""
    corners = body.shape.vertices[body.shape.faces[row]] * body.scale @ body.rotation.T + body.translation
    edges = np.roll(corners, -1, 0) - corners
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    to_point = point - corners
    is_on = np.linalg.norm(to_point - (to_point * edges).sum(1, keepdims=True) * edges, axis=1) < reach
    if is_on.sum() == 1:
        return np.asarray(edges[is_on])
    return np.linalg.svd(edges)[2][:2] if not is_on.any() else np.empty((0, 3))


def of_depth(field: Placed, along: Array, point: Array, reach: float) -> Array | None:
    """g for the deepest point in a field of a surface with these directions; None where the gradients do not balance."""
    gradients = field.gradients(point, point[None])
    # The rest of the balance points away from the side on which the surface would be deeper. The face that is nearest there
    # is the one that is missing.
    for _ in range(32):
        slopes = along @ gradients.T
        shares = _least_squares(np.vstack([slopes, np.ones(len(gradients))]), np.r_[np.zeros(len(along)), 1.0])
        shares /= shares.sum()
        rest = along.T @ (slopes @ shares)
        length = float(np.linalg.norm(rest))
        if length < 1e-7:
            break
        beside = point - reach * rest / length
        more = _distinct(np.concatenate([gradients, field.gradients(point, beside[None])]))
        if len(more) == len(gradients):
            break
        gradients = more
    return np.asarray(shares @ gradients[: len(shares)]) if length < 1e-4 else None


def _distinct(rows: Array) -> Array:
    kept: list[Array] = []
    for row in rows:
        if all(np.abs(row - other).max() > 1e-6 for other in kept):
            kept.append(row)
    return np.array(kept)


def _least_squares(a: Array, b: Array) -> Array:
    """x ≥ 0 with the least |a x − b|: Lawson and Hanson's algorithm."""
    x, used = np.zeros(a.shape[1]), np.zeros(a.shape[1], bool)
    for _ in range(3 * a.shape[1]):
        slope = a.T @ (b - a @ x)
        slope[used] = -np.inf
        if slope.max() <= 1e-12:
            break
        used[slope.argmax()] = True
        while True:
            step = np.zeros_like(x)
            step[used] = np.linalg.lstsq(a[:, used], b, rcond=None)[0]
            below = used & (step <= 0)
            if not below.any():
                break
            share = (x[below] / np.maximum(x[below] - step[below], 1e-300)).min()
            x += share * (step - x)
            used &= x > 1e-14
            x[~used] = 0
        x = step
    return x
