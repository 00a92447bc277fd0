"""Signed distances with derivatives, for JAX.

    import tesdf.jax

    distance = tesdf.jax.signed_distance("part.stl", points)      # also under jit, vmap and grad
    push = jax.grad(lambda points: tesdf.jax.signed_distance("part.stl", points).sum())(points)

The distances are computed on the processor, in float64, by a callback; results have the type of the
points, which JAX makes float32 unless `jax_enable_x64` is set. Derivatives by poses and scales are those
of the points: move the points into the frame of the mesh by JAX's own functions. The derivative by a point
is the unit gradient there; where several faces are equally near it is that of one of them. There are
first derivatives only: `jax.jvp`, `jax.hessian` and the like are errors.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from . import _native

if TYPE_CHECKING:
    from .bodies import Mesh

__all__ = ["signed_distance"]


def signed_distance(mesh: Mesh, points: Any) -> jax.Array:
    """The signed distances [...] of points [..., 3] to a mesh, in its frame and unit.

    A mesh is one of those of `tesdf.signed_distance`: encoded once, found by its content.
    """
    points = jnp.asarray(points)
    if not jnp.issubdtype(points.dtype, jnp.floating):
        raise TypeError(f"points: an array of {points.dtype}; expected floating-point numbers")
    if points.ndim == 0 or points.shape[-1] != 3:
        raise ValueError(f"points: an array of shape {points.shape}; expected shape (..., 3)")
    asset = _native.asset_of(mesh)

    def on_processor(at: Any) -> tuple[Any, Any]:
        rows = np.asarray(at)
        found = asset.query(rows.reshape(-1, 3).astype(np.float64))
        distance, gradient = found.signed_distance.astype(rows.dtype), found.gradient.astype(rows.dtype)
        return distance.reshape(rows.shape[:-1]), gradient.reshape(rows.shape)

    def query(at: jax.Array) -> Any:
        kinds = [jax.ShapeDtypeStruct(shape, at.dtype) for shape in (at.shape[:-1], at.shape)]
        return jax.pure_callback(on_processor, tuple(kinds), at, vmap_method="broadcast_all")

    distance = jax.custom_vjp(lambda at: query(at)[0])
    distance.defvjp(query, lambda gradient, by_distance: (by_distance[..., None] * gradient,))
    return distance(points)
