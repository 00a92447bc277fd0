# mypy: ignore-errors
"""Kernels of the coupling to MJWarp, in the language of Warp."""

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
