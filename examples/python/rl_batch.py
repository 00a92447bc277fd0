"""256 worlds with a peg over a hole each, as reinforcement learning wants them: arrays in, arrays out.

python examples/python/rl_batch.py
"""

import time
from pathlib import Path

import numpy as np
import tesdf

PARTS = Path(__file__).resolve().parents[2] / "data" / "procedural"
WORLDS, SLOTS, STEPS = 256, 8, 5
peg = tesdf.encode(PARTS / "lobed_peg.obj", "fast")
hole = tesdf.encode(PARTS / "lobed_hole_c100.obj", "fast")


def make(worlds):
    """A scene with a hole and a peg in each world. Bodies of different worlds do not meet."""
    scene = tesdf.Scene()
    rest = np.tile([0.0, 0, 0, 0, 0, 0, 1], (worlds, 1))
    scene.add_many(scene.add_shape(hole), rest, world=np.arange(worlds))
    return scene, scene.add_many(scene.add_shape(peg), rest, world=np.arange(worlds))


def observe(scene, worlds):
    """[worlds, SLOTS, 7]: point, normal and distance of up to SLOTS contacts that are spread over the places
    that touch; the other slots have NaN."""
    contacts = scene.detect(mode="node", contact_distance=2e-4, spread=SLOTS)
    world = contacts.instance_a % worlds  # the ids of holes are followed by those of pegs
    order = np.argsort(world, kind="stable")
    world = world[order]
    slot = np.arange(len(world)) - np.searchsorted(world, world)
    observation = np.full((worlds, SLOTS, 7), np.nan)
    rows = np.column_stack([contacts.point_a, contacts.normal, contacts.distance])[order]
    observation[world[slot < SLOTS], slot[slot < SLOTS]] = rows[slot < SLOTS]
    return observation


random = np.random.default_rng(3)
scene, pegs = make(WORLDS)
poses = np.zeros((WORLDS, 7))
poses[:, :2] = random.uniform(-1e-4, 1e-4, (WORLDS, 2))
poses[:, 2] = random.uniform(5e-3, 40e-3, WORLDS)  # from the floor of the hole to above it
turn = random.uniform(-0.02, 0.02, WORLDS)
poses[:, 5], poses[:, 6] = np.sin(turn / 2), np.cos(turn / 2)

start, found = time.perf_counter(), 0
for _ in range(STEPS):
    poses[:, :3] += random.normal(0, 3e-5, (WORLDS, 3))  # the policy's action
    scene.update(pegs, poses=poses)
    observation = observe(scene, WORLDS)
    found += np.isfinite(observation[..., 6]).sum()
seconds = time.perf_counter() - start
touching = np.isfinite(observation[:, 0, 6])
print(f"{touching.sum()} of {WORLDS} pegs touch; the deepest is {-np.nanmin(observation[..., 6]) * 1e3:.3f} mm deep")
print(f"{found} contacts in {STEPS} steps; {WORLDS * STEPS / seconds:.0f} worlds per second")

# A world sees the same, bit for bit, whether the others are there or not.
alone, one = make(1)
for world in (0, 100, 255):
    alone.update(one, poses=poses[world : world + 1])
    assert np.array_equal(observe(alone, 1)[0], observation[world], equal_nan=True)
assert 0 < touching.sum() < WORLDS
