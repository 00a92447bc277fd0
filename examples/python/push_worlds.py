"""256 worlds in which a box is pushed to a goal on a table, each with another mass and friction, as reinforcement
learning randomises them. Worlds that are done begin again from another place.

python examples/python/push_worlds.py
"""

import time

import numpy as np
import tesdf

WORLDS, STEPS, GOAL = 256, 60, np.array([0.1, 0.0])
SCENE = {
    "time_step": 5e-3,
    "duration": 1,
    "bodies": [
        {"name": "table", "shape": tesdf.Plane(), "fixed": True, "friction": 1},
        {
            "name": "box",
            "shape": tesdf.Box((0.03, 0.02, 0.015)),
            "mass": 0.3,
            "friction": 1,
            "pose": [0, 0, 0.015, 0, 0, 0, 1],
        },
    ],
}
random = np.random.default_rng(3)
worlds = tesdf.Worlds(SCENE, WORLDS)
box = worlds.bodies.index("box")
start = worlds.poses[0]


def places(count):
    """Poses [count, bodies, 7]: the box is up to 50 mm from the middle, turned about the vertical."""
    poses = np.tile(start, (count, 1, 1))
    poses[:, box, :2] += random.uniform(-0.05, 0.05, (count, 2))
    angle = random.uniform(-np.pi, np.pi, count)
    poses[:, box, 5], poses[:, box, 6] = np.sin(angle / 2), np.cos(angle / 2)
    return poses


def observe():
    """[worlds, 16]: pose and velocity of the box, and the force that the table exerts on it."""
    return np.concatenate([worlds.poses[:, box], worlds.velocities[:, box], worlds.net_contact_forces[:, box]], axis=1)


def policy(observation):
    """Forces [worlds, 3]: a PD controller with noise, towards the goal."""
    force = np.zeros((len(observation), 3))
    force[:, :2] = 40 * (GOAL - observation[:, :2]) - 2 * observation[:, 7:9] + random.normal(0, 0.5, (len(observation), 2))
    return force


mass, friction = random.uniform(0.1, 0.6, WORLDS), random.uniform(0.05, 0.5, WORLDS)
worlds.set_mass("box", mass)
worlds.set_friction("table", friction**2)  # between two bodies, the geometric mean of theirs acts
starts = places(WORLDS)
worlds.reset(poses=starts)

begin, of_resets, resets, pushes = time.perf_counter(), 0.0, 0, []
for _ in range(STEPS):
    pushes.append(policy(observe()))
    worlds.set_wrench("box", force=pushes[-1])
    worlds.step()
    done = np.linalg.norm(observe()[:, :2] - GOAL, axis=1) < 0.01
    if done.any():
        starts[done] = places(done.sum())
        before = time.perf_counter()
        worlds.reset(done, poses=starts[done])
        of_resets += time.perf_counter() - before
        resets += done.sum()
seconds = time.perf_counter() - begin
print(f"{WORLDS * STEPS / seconds:.0f} steps of a world per second")
print(f"{resets} boxes reached the goal and began again, {of_resets / max(resets, 1) * 1e6:.1f} us each")
assert resets > 100 and len(np.unique(worlds.steps)) > 10

# The table carries the boxes that slide.
sliding = worlds.steps > 3
force = worlds.net_contact_forces[sliding, box]
assert np.allclose(force[:, 2], 9.81 * mass[sliding], rtol=1e-3)
assert (np.linalg.norm(force[:, :2], axis=1) < 1.001 * friction[sliding] * force[:, 2]).all()

# A world is the same, bit for bit, as it is alone.
for world in (0, 100, 255):
    alone = tesdf.Simulation(SCENE, history=False)
    alone.set_mass("box", mass[world])
    alone.set_friction("table", friction[world] ** 2)
    alone.reset(poses=starts[world])
    for push in pushes[STEPS - int(worlds.steps[world]) :]:
        alone.set_wrench("box", force=push[world])
        alone.step()
    assert alone.poses.tobytes() == worlds.poses[world].tobytes()

# From one moment on, 256 pushes are tried: what a controller that predicts does.
worlds.restore(worlds.snapshot([0]))
before = worlds.poses[0, box, :2]
angle = np.linspace(0, 2 * np.pi, WORLDS, endpoint=False)
worlds.set_wrench("box", force=np.column_stack([3 * np.cos(angle), 3 * np.sin(angle), np.zeros(WORLDS)]))
worlds.step(10)
best = np.linalg.norm(worlds.poses[:, box, :2] - GOAL, axis=1).argmin()
print(f"of 256 directions, {np.degrees(angle[best]):.0f} degrees brings the box nearest to the goal")
towards = GOAL - before
assert np.cos(angle[best] - np.arctan2(towards[1], towards[0])) > 0.7
