"""An arm moves around a part that is not convex, by motions that are certified as a whole.

python examples/python/plan_around_part.py

The planner is RRT-Connect (Kuffner and LaValle 2000): two trees of configurations, from the start and
the goal, grow towards random ones and towards each other.
"""

from pathlib import Path

import numpy as np
import tesdf

ROBOT = Path(__file__).resolve().parents[2] / "data" / "robots" / "six-axis-arm.urdf"
MARGIN, STEP = 2e-3, 0.4  # m of clearance, and the length of a motion, rad
# On both sides of the part; the straight way leads through it.
START, GOAL = np.array([1.1, 1.0, 0.6, 0, 0.4, 0]), np.array([-1.1, 1.0, 0.6, 0, 0.4, 0])


def fork():
    """A U of three boxes in one mesh, whose slot is open at the top."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = np.array([[a, b, c] for q in quads for a, b, c in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))])
    boxes = [((0, -0.2, 0.3), (0.06, 0.06, 0.3)), ((0, 0.2, 0.3), (0.06, 0.06, 0.3)), ((0, 0, 0.06), (0.07, 0.3, 0.06))]
    vertices = np.concatenate([np.array(center) + corners * half for center, half in boxes])
    return vertices, np.concatenate([faces + 8 * k for k in range(len(boxes))])


def scene():
    robot = tesdf.Robot(ROBOT)
    robot.add_obstacle("fork", tesdf.encode(fork(), "fast", surface="boundary"), [0.5, 0, 0, 0, 0, 0, 1])
    robot.add_obstacle("floor", tesdf.Plane(), [0, 0, -0.01, 0, 0, 0, 1])
    return robot


def connected(robot, tree, parents, q):
    """Grows a tree towards q. Returns whether it has come there."""
    near = int(np.argmin([np.linalg.norm(q - p) for p in tree]))
    while True:
        way = q - tree[near]
        length = np.linalg.norm(way)
        to = q if length <= STEP else tree[near] + STEP / length * way
        if not robot.check_motion(tree[near], to, margin=MARGIN):
            return False
        tree.append(to)
        parents.append(near)
        near = len(tree) - 1
        if to is q:
            return True


def path(tree, parents):
    k, found = len(tree) - 1, []
    while k >= 0:
        found.append(tree[k])
        k = parents[k]
    return found


def plan(robot, start, goal, seed=1, most=2000):
    random, (low, high) = np.random.default_rng(seed), robot.limits.T
    trees = [([start], [-1]), ([goal], [-1])]
    for k in range(most):
        grown, other = trees[k % 2], trees[1 - k % 2]
        target = random.uniform(low, high)
        near = min(grown[0], key=lambda p: np.linalg.norm(target - p))
        way = target - near
        connected(robot, *grown, near + STEP / max(np.linalg.norm(way), STEP) * way)
        if connected(robot, *other, grown[0][-1]):
            there, back = path(*grown)[::-1], path(*other)[1:]
            return (there + back) if k % 2 == 0 else (there + back)[::-1]
    raise SystemExit("no way was found")


def shortened(robot, way, seed=2, tries=150):
    """Leaves out what two certified motions do not need."""
    random = np.random.default_rng(seed)
    for _ in range(tries):
        if len(way) < 3:
            break
        i, j = sorted(random.choice(len(way), 2, replace=False))
        if j > i + 1 and robot.check_motion(way[i], way[j], margin=MARGIN):
            way = way[: i + 1] + way[j:]
    return way


if __name__ == "__main__":
    robot = scene()
    straight = robot.check_motion(START, GOAL, margin=MARGIN)
    print(f"straight: {straight.verdict} of {straight.body_a} and {straight.body_b} at {straight.parameter:.3f}")
    way = plan(robot, START, GOAL)
    short = shortened(robot, way)
    checks = robot.check_motions(short[:-1], short[1:], margin=MARGIN)
    samples = np.concatenate([a + np.linspace(0, 1, 200)[:, None] * (b - a) for a, b in zip(short, short[1:])])
    least = robot.clearances(samples).distance.min()
    print(f"planned: {len(way) - 1} motions, shortened to {len(short) - 1}; {checks.steps.sum()} intervals certify them")
    print(f"least clearance of {len(samples)} samples: {least * 1e3:.2f} mm")
    assert straight.verdict == "collision" and checks.free.all() and least > MARGIN
    assert (short[0] == START).all() and (short[-1] == GOAL).all()
