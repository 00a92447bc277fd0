"""Results of `tesdf.Robot`. Lengths are metres, in the world; bodies have the numbers of
`Robot.bodies`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np
import numpy.typing as npt

from .contacts import _Table

_Float = npt.NDArray[np.float64]
_Id = npt.NDArray[np.uint32]
_Bool = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class RobotClearance:
    """The clearance of a robot at a configuration: the least signed distance between its links and
    the obstacles, and between links that may not collide."""

    distance: float
    """negative where bodies overlap; inf without a pair to look at. At most the tolerance above the
    true value if `converged`"""
    lower_bound: float
    """the true value is between this and `distance`"""
    body_a: Optional[str]
    """name of a link of the nearest pair; None without a pair"""
    body_b: Optional[str]
    """name of the other body: a link or an obstacle"""
    point_a: Optional[_Float]
    """[3] witness point on a"""
    point_b: Optional[_Float]
    """[3] witness point on b"""
    normal: Optional[_Float]
    """[3] unit vector from b to a"""
    gradient: Optional[_Float]
    """[dof] derivatives of the distance by the configuration, m/rad or 1: those of the witness points
    along the normal. At a kink, where other features become the nearest, those on the side of the
    features that were found. Where bodies overlap and several faces are equally near to a witness,
    those of one face: a way out, and not the derivatives of the depth"""
    converged: bool
    """whether the error is within the tolerance"""


@dataclass(frozen=True, eq=False, repr=False)
class RobotClearances(_Table):
    """Clearances at many configurations, a row for each. `RobotClearance` says more."""

    distance: _Float
    """[N]"""
    lower_bound: _Float
    """[N]"""
    body_a: _Id
    """[N] number of a link of the nearest pair; 2^32 - 1 without a pair"""
    body_b: _Id
    """[N] number of the other body"""
    point_a: _Float
    """[N, 3] witness point on a"""
    point_b: _Float
    """[N, 3] witness point on b"""
    normal: _Float
    """[N, 3] unit vector from b to a"""
    gradient: _Float
    """[N, dof] derivatives of the distance by the configuration"""
    converged: _Bool
    """[N] whether the error is within the tolerance"""


@dataclass(frozen=True)
class MotionCheck:
    """What is known of a motion. It is true where the motion is free: `if robot.check_motion(q0, q1)`."""

    verdict: str
    """"free": the clearance is above the margin everywhere, certainly; "collision": it is not at
    `parameter`, certainly; "undecided": not known, because the clearance is above the margin by less
    than twice the tolerance, or the steps were used up"""
    parameter: Optional[float]
    """where it collides or is undecided, from 0 at q0 to 1 at q1; None if it is free"""
    body_a: Optional[str]
    """name of a link of the pair there"""
    body_b: Optional[str]
    """name of the other body"""
    distance: Optional[float]
    """signed distance of the two there, as far as it was searched: the true one is not greater"""
    steps: int
    """number of intervals of pairs of bodies that were looked at"""

    def __bool__(self) -> bool:
        return self.verdict == "free"


@dataclass(frozen=True, eq=False, repr=False)
class MotionChecks(_Table):
    """What is known of many motions, a row for each. `MotionCheck` says more."""

    free: _Bool
    """[N] whether it is certain that the clearance is above the margin everywhere"""
    collides: _Bool
    """[N] whether it is certain that it is not at `parameter`; undecided if neither"""
    parameter: _Float
    """[N] from 0 to 1; NaN if it is free"""
    body_a: _Id
    """[N] number of a link of the pair there; 2^32 - 1 if it is free"""
    body_b: _Id
    """[N] number of the other body"""
    distance: _Float
    """[N] signed distance of the two there; NaN if it is free"""
    steps: _Id
    """[N] number of intervals of pairs of bodies that were looked at"""
