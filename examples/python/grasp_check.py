"""Which of 10,000 grasps can a gripper take, and which has the most room?

python examples/python/grasp_check.py
"""

import time
from pathlib import Path

import numpy as np
import tesdf

PARTS = Path(__file__).resolve().parents[2] / "data" / "procedural"
COUNT, ROOM, GAP = 10_000, 3e-3, 13e-3  # grasps; room they must have, half of the open gap, in m
finger = tesdf.encode(PARTS / "gripper_finger.obj", "fast")  # 60 mm long, its pad in the plane x = 0
peg = tesdf.encode(PARTS / "lobed_peg.obj", "fast")  # 16 mm wide, 40 mm high

# A grasp is a pose of the hand: where its fingertips are, its turn about z, and its tilt about x.
random = np.random.default_rng(1)
tips = random.uniform([-8e-3, -8e-3, 2e-3], [8e-3, 8e-3, 50e-3], (COUNT, 3))
turn, tilt = random.uniform(-np.pi, np.pi, COUNT), random.normal(0, 0.2, COUNT)
zero, one = np.zeros(COUNT), np.ones(COUNT)
about_z = [[np.cos(turn), -np.sin(turn), zero], [np.sin(turn), np.cos(turn), zero], [zero, zero, one]]
about_x = [[one, zero, zero], [zero, np.cos(tilt), -np.sin(tilt)], [zero, np.sin(tilt), np.cos(tilt)]]
hand = np.tile(np.eye(4), (COUNT, 1, 1))
hand[:, :3, :3] = np.moveaxis(about_z, -1, 0) @ np.moveaxis(about_x, -1, 0)
hand[:, :3, 3] = tips
left = np.array([[1, 0, 0, -GAP], [0, -1, 0, 0], [0, 0, -1, 0.06], [0, 0, 0, 1]])
right = np.array([[-1, 0, 0, GAP], [0, 1, 0, 0], [0, 0, -1, 0.06], [0, 0, 0, 1]])

# One world for each grasp. The vertices of all bodies at once leave few grasps.
scene, worlds, rest = tesdf.Scene(), np.arange(COUNT), np.tile(np.eye(4), (COUNT, 1, 1))
start = time.perf_counter()
shape = scene.add_shape(finger)
fingers = [scene.add_many(shape, hand @ side, world=worlds) for side in (left, right)]
things = [scene.add_many(scene.add_shape(thing), rest, world=worlds) for thing in (peg, tesdf.Plane())]
near = scene.detect(mode="node", contact_distance=ROOM, reduce=1)
world = np.empty(4 * COUNT, int)
world[np.concatenate(fingers + things)] = np.tile(worlds, 4)
is_finger = np.isin(np.stack([near.instance_a, near.instance_b]), fingers).any(axis=0)  # the peg stands on the plane
free = np.setdiff1d(worlds, world[near.instance_a[is_finger]])
# The peg is between the fingers: its middle is, and not above or below them.
middle = np.einsum("nji,nj->ni", hand[:, :3, :3], [0, 0, 0.02] - tips)
free = free[(np.abs(middle[free]) < [4e-3, 6e-3, 1]).all(axis=1) & (middle[free, 2] > 0)]
seconds = time.perf_counter() - start

# The exact clearance of these grasps.
room = np.array([[scene.clearance(f[k], t[k]).distance for f in fingers for t in things] for k in free]).min(axis=1)
best = free[room.argmax()]
print(f"{len(free)} of {COUNT:,} grasps hold the peg with {ROOM * 1e3:.0f} mm of room ({seconds:.1f} s)")
print(f"the best one has {room.max() * 1e3:.3f} mm: tips at {np.round(tips[best] * 1e3, 1)} mm, turned by {np.degrees(turn[best]):.0f}°")

# The fingers close on it at 10 mm/s.
axis = 0.01 * hand[best, :3, 0]
for name, f, velocity in zip(("left", "right"), fingers, (axis, -axis)):
    impact = scene.time_of_impact(f[best], things[0][best], velocity_a=[*velocity, 0, 0, 0], end=2.0)
    assert impact is not None and impact.verdict == "impact"
    print(f"  the {name} finger touches after {impact.time:.3f} s at {np.round(1e3 * np.array(impact.point_b), 2)} mm")
    assert impact.time > 0
assert 10 < len(free) < 1000 and room.min() > ROOM / 2
