"""The same task as that of `plan_around_part.py`, planned by OMPL: its planner, with certified motions.

pip install ompl
python examples/python/plan_with_ompl.py
"""

import numpy as np
import tesdf
from ompl import base, geometric, util
from plan_around_part import GOAL, MARGIN, START, scene

robot = scene()
space = base.RealVectorStateSpace(len(robot.joints))
bounds = base.RealVectorBounds(len(robot.joints))
for k, (low, high) in enumerate(robot.limits):
    bounds.setLow(k, low)
    bounds.setHigh(k, high)
space.setBounds(bounds)
setup = geometric.SimpleSetup(space)
info = setup.getSpaceInformation()


def configuration(state):
    return np.array([state[k] for k in range(len(robot.joints))])


class Certified(base.MotionValidator):
    """Motions as a whole, in place of OMPL's samples of them."""

    def checkMotion(self, a, b, *last_valid):
        return bool(robot.check_motion(configuration(a), configuration(b), margin=MARGIN))


def state(q):
    made = space.allocState()
    for k, x in enumerate(q):
        made[k] = float(x)
    return made


util.RNG.setSeed(1)
setup.setStateValidityChecker(lambda state: not robot.is_clearance_below(configuration(state), MARGIN))
validator = Certified(info)
info.setMotionValidator(validator)
setup.setStartAndGoalStates(state(START), state(GOAL))
setup.setPlanner(geometric.RRTConnect(info))
assert setup.solve(60.0), "no way was found"
setup.simplifySolution()
way = np.array([configuration(state) for state in setup.getSolutionPath().getStates()])
checks = robot.check_motions(way[:-1], way[1:], margin=MARGIN)
samples = np.concatenate([a + np.linspace(0, 1, 200)[:, None] * (b - a) for a, b in zip(way, way[1:])])
print(f"{len(way) - 1} motions; least clearance of {len(samples)} samples: {robot.clearances(samples).distance.min() * 1e3:.2f} mm")
assert checks.free.all() and robot.clearances(samples).distance.min() > MARGIN
