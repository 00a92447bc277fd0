# mypy: ignore-errors
"""Kernels of the coupling to Newton, in the language of Warp, for contacts that stay on a CUDA device. On the
processor numpy does the same in f64."""

from __future__ import annotations

import warp as wp


@wp.kernel(enable_backward=False)
def place(
    shapes: wp.array[int],
    transforms: wp.array[wp.transform],
    linear: wp.array[wp.vec3],
    angular: wp.array[wp.vec3],
    poses: wp.array2d[float],
    velocities: wp.array2d[float],
) -> None:
    """The poses and velocities of the instances, of which each is a shape. Without velocities all are at rest."""
    row = wp.tid()
    shape = shapes[row]
    transform = transforms[shape]
    origin, rotation = wp.transform_get_translation(transform), wp.normalize(wp.transform_get_rotation(transform))
    for k in range(3):
        poses[row, k] = origin[k]
        if linear.shape[0] > 0:
            velocities[row, k] = linear[shape][k]
        if angular.shape[0] > 0:
            velocities[row, 3 + k] = angular[shape][k]
    for k in range(4):
        poses[row, 3 + k] = rotation[k]


@wp.kernel(enable_backward=False)
def meet(
    shapes: wp.array[int],
    shape_count: wp.int64,
    keys: wp.array[wp.int64],
    instances: wp.array[wp.vec2i],
    meets: wp.array[int],
) -> None:
    """Whether the two shapes of a contact are a candidate pair. `keys` has those of the pairs, ascending."""
    found = wp.tid()
    a, b = shapes[instances[found][0]], shapes[instances[found][1]]
    key = wp.int64(wp.min(a, b)) * shape_count + wp.int64(wp.max(a, b))
    at = wp.lower_bound(keys, key)
    meets[found] = 0
    if at < keys.shape[0]:
        if keys[at] == key:
            meets[found] = 1


@wp.kernel(enable_backward=False)
def write(
    first: int,
    shapes: wp.array[int],
    margins: wp.array[float],
    body_q: wp.array[wp.transform],
    shape_body: wp.array[int],
    meets: wp.array[int],
    places: wp.array[int],
    point_a: wp.array[wp.vec3],
    point_b: wp.array[wp.vec3],
    normal: wp.array[wp.vec3],
    instances: wp.array[wp.vec2i],
    shape0: wp.array[int],
    shape1: wp.array[int],
    point0: wp.array[wp.vec3],
    point1: wp.array[wp.vec3],
    offset0: wp.array[wp.vec3],
    offset1: wp.array[wp.vec3],
    margin0: wp.array[float],
    margin1: wp.array[float],
    normals: wp.array[wp.vec3],
) -> None:
    """Writes the contacts of candidate pairs after the first ones. `places` counts them, from 1."""
    found = wp.tid()
    if meets[found] == 0:
        return
    at = first + places[found] - 1
    # Newton's normal points from shape 0 to shape 1.
    one, two = shapes[instances[found][1]], shapes[instances[found][0]]
    to_one, to_two = wp.transform_identity(), wp.transform_identity()
    if shape_body[one] >= 0:
        to_one = wp.transform_inverse(body_q[shape_body[one]])
    if shape_body[two] >= 0:
        to_two = wp.transform_inverse(body_q[shape_body[two]])
    shape0[at] = one
    shape1[at] = two
    point0[at] = wp.transform_point(to_one, point_b[found])
    point1[at] = wp.transform_point(to_two, point_a[found])
    offset0[at] = wp.transform_vector(to_one, margins[one] * normal[found])
    offset1[at] = wp.transform_vector(to_two, -margins[two] * normal[found])
    margin0[at] = margins[one]
    margin1[at] = margins[two]
    normals[at] = normal[found]
