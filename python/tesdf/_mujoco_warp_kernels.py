# mypy: ignore-errors
"""Kernels of the coupling to MJWarp, in the language of Warp. Those that place shapes and fill contacts
serve where contacts stay on a CUDA device; on the processor numpy does the same in f64."""

from __future__ import annotations

import mujoco as mj
import warp as wp

_LEAST_IMPEDANCE, _GREATEST_IMPEDANCE = wp.constant(mj.mjMINIMP), wp.constant(mj.mjMAXIMP)
_Vec5 = wp.types.vector(length=5, dtype=float)


@wp.kernel(enable_backward=False)
def look_ahead(
    first: int,
    elliptic: int,
    refsafe: int,
    timestep: wp.array[float],
    dist: wp.array[float],
    worldid: wp.array[int],
    efc_address: wp.array2d[int],
    solref: wp.array[wp.vec2],
    solimp: wp.array[_Vec5],
    vel: wp.array2d[float],
    aref: wp.array2d[float],
    margin: wp.array2d[float],
) -> None:
    """Turns the sign of the gap in the rows of contacts that do not touch yet: MJWarp made
    aref = s + t, with the spring's s and t = -b * vel; -s + t is what closes the gap."""
    contact = first + wp.tid()
    if dist[contact] < 0.0:
        return
    world = worldid[contact]
    step = timestep[world % timestep.shape[0]]
    reference = solref[contact]
    greatest = wp.clamp(solimp[contact][1], _LEAST_IMPEDANCE, _GREATEST_IMPEDANCE)
    damping = -reference[1] / greatest
    if reference[1] > 0.0:
        constant = reference[0]
        if refsafe != 0:
            constant = wp.max(constant, 2.0 * step)
        damping = 2.0 / (greatest * constant)
    for row in range(efc_address.shape[1]):
        # With an elliptic cone, only the first row has the gap.
        address = efc_address[contact, row]
        if address >= 0 and (row == 0 or elliptic == 0):
            aref[world, address] = -aref[world, address] - 2.0 * damping * vel[world, address]
            margin[world, address] = 0.0


@wp.kernel(enable_backward=False)
def place(
    geoms: wp.array[int],
    bodies: wp.array[int],
    roots: wp.array[int],
    falls: wp.array[int],
    rotations: wp.array[wp.quat],
    translations: wp.array[wp.vec3],
    timestep: wp.array[float],
    gravity: wp.array[wp.vec3],
    xpos: wp.array2d[wp.vec3],
    xmat: wp.array2d[wp.mat33],
    cvel: wp.array2d[wp.spatial_vector],
    subtree_com: wp.array2d[wp.vec3],
    poses: wp.array2d[float],
    velocities: wp.array2d[float],
) -> None:
    """The poses and velocities of the frames of assets, a row for each geom of each world. `falls` is 1 for
    geoms on which gravity acts."""
    world, shape = wp.tid()
    geom = geoms[shape]
    axes = xmat[world, geom]
    rotation = wp.normalize(wp.quat_from_matrix(axes) * rotations[shape])
    arm = axes * translations[shape]
    origin = xpos[world, geom] + arm
    velocity = cvel[world, bodies[shape]]
    angular = wp.spatial_top(velocity)
    # From that of the tree's centre of mass.
    linear = wp.spatial_bottom(velocity) + wp.cross(angular, origin - subtree_com[world, roots[shape]])
    if falls[shape] == 1:
        linear += gravity[world % gravity.shape[0]] * timestep[world % timestep.shape[0]]
    row = world * geoms.shape[0] + shape
    for k in range(3):
        poses[row, k] = origin[k]
        velocities[row, k] = linear[k]
        velocities[row, 3 + k] = angular[k]
    for k in range(4):
        poses[row, 3 + k] = rotation[k]


@wp.kernel(enable_backward=False)
def fill(
    first: int,
    least_margin: float,
    geoms: wp.array[int],
    pairs: wp.array2d[int],
    pair_count: int,
    of_condim: wp.array[int],
    of_friction: wp.array[_Vec5],
    of_solref: wp.array[wp.vec2],
    of_solimp: wp.array[_Vec5],
    point_a: wp.array[wp.vec3],
    point_b: wp.array[wp.vec3],
    normal: wp.array[wp.vec3],
    distance: wp.array[float],
    instances: wp.array[wp.vec2i],
    dist: wp.array[float],
    pos: wp.array[wp.vec3],
    frame: wp.array[wp.mat33],
    includemargin: wp.array[float],
    friction: wp.array[_Vec5],
    solref: wp.array[wp.vec2],
    solimp: wp.array[_Vec5],
    dim: wp.array[int],
    geom: wp.array[wp.vec2i],
    worldid: wp.array[int],
    geomcollisionid: wp.array[int],
) -> None:
    """Writes contacts after the first ones. `pairs` has the row of two geoms among `pair_count` rows of
    parameters, which there are for each world."""
    found = wp.tid()
    contact = first + found
    # MuJoCo's normal points from the first geom to the second one.
    both = instances[found]
    count = geoms.shape[0]
    world = both[0] / count
    one, two = both[1] % count, both[0] % count
    kind = world * pair_count + pairs[one, two]
    dist[contact] = distance[found]
    pos[contact] = 0.5 * (point_a[found] + point_b[found])
    # As `contact_frames`.
    n = normal[found]
    across = wp.vec3(-n[2], 0.0, n[0])
    if wp.abs(n[0]) < 0.7:
        across = wp.vec3(0.0, n[2], -n[1])
    across = wp.normalize(across)
    frame[contact] = wp.matrix_from_rows(n, across, wp.cross(n, across))
    includemargin[contact] = wp.max(2.0 * distance[found], least_margin)
    friction[contact] = of_friction[kind]
    solref[contact] = of_solref[kind]
    solimp[contact] = of_solimp[kind]
    dim[contact] = of_condim[kind]
    geom[contact] = wp.vec2i(geoms[one], geoms[two])
    worldid[contact] = world
    geomcollisionid[contact] = found
