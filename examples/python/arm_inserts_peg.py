"""An arm of six joints puts its peg into a hole that is not where it believes. It feels for the hole: it pushes lightly,
moves in a spiral until the peg falls in, and then gives way to the walls.

python examples/python/arm_inserts_peg.py
"""

from pathlib import Path

import numpy as np
import tesdf

PUSH, DEEP, TIME_STEP = 8.0, 0.055, 2e-3
# The peg has a radius of 10 mm, the hole is 20.2 mm wide, and the arm believes that it is here.
BELIEVED, ERROR = np.array([0.35, -0.05, 0.13]), np.array([0.45e-3, -0.3e-3, 0])
JOINTS = {  # the links that joints move, and their axes in the frames of these
    "pan": ("shoulder", [0, 0, 1]),
    "lift": ("upper", [0, 1, 0]),
    "elbow": ("fore", [0, 1, 0]),
    "roll": ("wrist", [0, 0, -1]),
    "bend": ("hand", [0.6, 0.8, 0]),
}
# The peg points down, above where the arm believes the hole to be.
START = [-0.22478007773565867, 0.08067094774088736, 1.758434842437156, -0.5869309853459533, 1.2028064151200517, 0]
# As an impedance controller has them: N m/rad and N m s/rad, of the slider N/m and N s/m.
SPRINGS = [(2000, 100), (8000, 200), (8000, 200), (2000, 50), (2000, 50), (20000, 400)]
NAMES = [*JOINTS, "reach"]


def wall(half, at):
    return {"shape": {"box": {"half_extents": half}}, "translation": at}


simulation = tesdf.Simulation(
    {
        "time_step": TIME_STEP,
        "duration": 10,
        "bodies": [
            {
                "name": "hole",
                "fixed": True,
                "translation": (BELIEVED + ERROR).tolist(),
                "parts": [  # around the z axis, and a floor at z = 0
                    wall([0.015, 0.04, 0.03], [0.0251, 0, 0.03]),
                    wall([0.015, 0.04, 0.03], [-0.0251, 0, 0.03]),
                    wall([0.0101, 0.015, 0.03], [0, 0.0251, 0.03]),
                    wall([0.0101, 0.015, 0.03], [0, -0.0251, 0.03]),
                    wall([0.0401, 0.0401, 0.005], [0, 0, -0.005]),
                ],
            }
        ],
        "robots": [
            {
                "file": str(Path(__file__).resolve().parents[2] / "data/robots/peg-arm.urdf"),
                "fixed": True,
                "coordinates": dict(zip(NAMES, START)),
                "motors": {
                    name: {"drive": {"spring": {"rest": rest, "stiffness": stiffness, "damping": damping}}}
                    for name, rest, (stiffness, damping) in zip(NAMES, START, SPRINGS)
                },
            }
        ],
    }
)
hole, peg = simulation.bodies.index("hole"), simulation.bodies.index("peg")


def rotated(quaternion, vector):
    v, w = quaternion[:3], quaternion[3]
    return vector + 2 * np.cross(v, np.cross(v, vector) + w * np.asarray(vector))


def jacobian():
    """By the rates of the hinges, [5, 5]: the velocity of the peg, and how fast it leans about x and y, in the world."""
    poses, columns = simulation.poses, []
    for link, axis in JOINTS.values():
        pose = poses[simulation.bodies.index(link)]
        axis = rotated(pose[3:], axis)
        columns.append([*np.cross(axis, poses[peg, :3] - pose[:3]), *axis[:2]])
    return np.transpose(columns)


def force():
    """Force [3] of the hole on the peg, N."""
    return simulation.contact_forces.on(peg)


def move(rest, way):
    """Moves where the joints rest so that the peg moves along `way`, m, without leaning, and makes a step: the slider up
    and down, and the hinges aside."""
    rest[:5] += np.linalg.solve(jacobian(), [*way[:2], 0, 0, 0])
    rest[5] -= way[2]
    for name, at, spring in zip(NAMES, rest, SPRINGS):
        simulation.set_motor(name, spring=(at, *spring), limit=200)
    simulation.step()


def depth():
    """How far the lower end of the peg is below the upper side of the walls, m."""
    poses = simulation.poses
    return poses[hole, 2] + 0.06 - (poses[peg, 2] - 0.04)


rest = np.array(START)
while force()[2] < PUSH:  # down, until it touches
    move(rest, [0, 0, -0.05 * TIME_STEP])
aim = simulation.poses[peg, :2] - simulation.poses[hole, :2]
print(f"the peg touches the walls {1e3 * np.linalg.norm(aim):.2f} mm beside the middle of the hole")
assert abs(depth()) < 1e-4 and np.abs(aim).max() > 1e-4

angle, at, peak, steps = 0.0, np.zeros(2), 0.0, 0
while depth() < 1e-3:  # in a spiral of 0.15 mm each turn, at 15 mm/s
    radius = max(0.15e-3 * angle / (2 * np.pi), 2e-5)
    angle += min(15e-3 * TIME_STEP / radius, 0.3)
    new = 0.15e-3 * angle / (2 * np.pi) * np.array([np.cos(angle), np.sin(angle)])
    error = force()[2] - PUSH
    move(rest, [*(new - at), np.clip(2e-6 * error, -1e-5, 1e-5)])
    at, peak, steps = new, max(peak, np.linalg.norm(force())), steps + 1
    assert steps < 3000, "no hole was found"
print(f"after {steps * TIME_STEP:.2f} s of search, {1e3 * np.linalg.norm(at):.2f} mm away, it falls into the hole")

while depth() < DEEP or force()[2] < PUSH:  # down, and away from walls that push
    push = force()
    is_free = np.linalg.norm(push) < 3 * PUSH
    way = np.append(1e-6 * push[:2], -0.05 * TIME_STEP if is_free else 0)
    move(rest, np.clip(way, -1e-4, 1e-4))
    peak, steps = max(peak, np.linalg.norm(push)), steps + 1
    assert steps < 6000, "the peg is stuck"
print(f"the peg is {1e3 * depth():.2f} mm deep; the greatest force was {peak:.1f} N")
assert depth() > 0.0599 and peak < 60 and not simulation.warnings, simulation.warnings
