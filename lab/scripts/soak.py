#!/usr/bin/env python3
"""Runs what should run for ever, for as long as it is told to: results stay in bounds, and memory stays flat.

    python -m venv VENV && VENV/bin/pip install mujoco ./python
    VENV/bin/python lab/scripts/soak.py --hours 0.1 > table.md      # a part of each
    VENV/bin/python lab/scripts/soak.py --hours 33.6 > table.md     # a week of five parts, one after the other

- *stack*: ten cubes on each other, awake: no coordinate moves by 1 pm.
- *nut*: goes up and down its bolt by half a turn, as gravity turns around and brakes it; depth below 1 µm, travel and
  turns within the play of the thread.
- *worlds*: 64 worlds of boxes of random sizes that are thrown again and again; all finite, none through the floor.
- *mujoco*: the nut in MuJoCo with contacts of tesdf, up and down.
- *encodes*: random meshes; signed distances at random points against numpy's brute force, within 1e-12 of the
  diagonal.

Resident memory and page faults are compared after a tenth of the time and at the end. A bound that does not hold
ends the program with exit code 1 and says the seed or step.
"""
import argparse
import resource
import sys
import time

import numpy as np
import tesdf
from measured import ROOT, head, heading, row

from make_reference import sdf  # of data, which `measured` adds to the path

PITCH = 2e-3  # m, of the thread
PLAY = 60e-6  # m, of the thread along its axis
FASTEST = 1.5  # turns a second; nothing else slows a nut down that turns around again and again
GROWTH = 8e6  # bytes that memory may grow by after the first tenth


class OutOfBounds(Exception):
    pass


def expect(condition, message):
    if not condition:
        raise OutOfBounds(message)


def resident():
    pages = int(open("/proc/self/statm").read().split()[1])
    return pages * resource.getpagesize()


# ------------------------------------------------------------------ parts: generators that yield (units, worst) for ever
def stack(_):
    scene = tesdf.Simulation(ROOT / "scenes/stack.toml", history=False)
    first = scene.poses
    while True:
        scene.step(1000)
        moved = np.abs(scene.poses - first).max()
        expect(moved < 1e-12, f"step {scene.steps}: moved by {moved:g} m")
        yield 1000, moved


def turned(before, after):
    """the angle about z by which a quaternion x y z w has turned, rad"""
    angle = 2 * (np.arctan2(after[0], after[1]) - np.arctan2(before[0], before[1]))
    return (angle + np.pi) % (2 * np.pi) - np.pi


def driven(turns, rate, drive):
    """the gravity along z, m/s², that drives a nut on between 0 and half a turn, and `drive` without braking"""
    drive = -9.81 if turns < 0 else 9.81 if turns > 0.5 else drive
    return (-drive if abs(rate) > FASTEST and rate * drive < 0 else drive), drive


def nut(_):
    scene = tesdf.Simulation(ROOT / "scenes/bolt-nut.toml", history=False)
    which = scene.bodies.index("nut")
    start, turns, drive = scene.poses[which, 2], 0.0, -9.81
    while True:
        deepest = 0.0
        for _ in range(10):
            before, begun = scene.poses[which], scene.time
            scene.step()
            turn = turned(before[3:5], scene.poses[which, 3:5]) / (2 * np.pi)
            turns += turn
            if len(scene.contacts.distance):
                deepest = max(deepest, -scene.contacts.distance.min())
            gravity, drive = driven(turns, turn / (scene.time - begun), drive)
            scene.set_gravity([0, 0, gravity])
        off = abs(start - scene.poses[which, 2] - turns * PITCH)
        expect(deepest < 1e-6, f"step {scene.steps}: {deepest:g} m deep")
        expect(off < PLAY, f"step {scene.steps}: travel and turns differ by {off:g} m")
        yield 10, deepest


def worlds(random):
    sides = random.uniform(0.03, 0.1, (3, 3))
    bodies = [{"name": "floor", "shape": "plane", "fixed": True, "friction": 0.5}]
    bodies += [
        {"name": str(k), "shape": {"box": {"half_extents": list(side)}}, "density": 500, "friction": 0.5,
         "translation": [0, 0, 0.2 + 0.3 * k]} for k, side in enumerate(sides)
    ]
    many = tesdf.Worlds({"time_step": 0.005, "duration": 1.0, "bodies": bodies}, 64)
    resting = many.poses[0]
    while True:
        velocities = random.normal(size=(64, 4, 6)) * [1, 1, 1, 5, 5, 5]
        velocities[:, 0] = 0
        many.reset(velocities=velocities)
        many.step(200)
        poses = many.poses
        expect(np.isfinite(poses).all() and np.isfinite(many.velocities).all(), "a state is not finite")
        lowest = poses[:, 1:, 2].min()
        expect(lowest > sides.min() - 1e-3, f"a centre is {lowest:g} m above the floor")
        expect((poses[:, 0] == resting[0]).all(), "the floor moved")
        yield 200 * 64, sides.min() - lowest


def in_mujoco(_):
    import mujoco
    import tesdf.mujoco

    model = mujoco.MjModel.from_xml_path(str(ROOT / "examples/python/models/bolt-nut.xml"))
    data = mujoco.MjData(model)
    parts = {"bolt": "iso_m16_bolt_24k", "nut": "iso_m16_nut_c50"}
    assets = {name: tesdf.encode(ROOT / f"data/procedural/{file}.obj", "fast") for name, file in parts.items()}
    contacts = tesdf.mujoco.Contacts(model, assets)
    mujoco.mj_forward(model, data)
    turns, clearance, drive = 0.0, 0.0, -9.81
    while True:
        for _ in range(100):
            contacts.step(model, data)
            rate = data.qvel[5] / (2 * np.pi)
            turns += rate * model.opt.timestep
            model.opt.gravity[2], drive = driven(turns, rate, drive)
        expect(np.isfinite(data.qpos).all(), f"{data.time:g} s: not finite")
        depth = -contacts.scene.clearance(0, 1).distance
        expect(depth < 20e-6, f"{data.time:g} s: {depth:g} m deep")
        clearance = max(clearance, depth)
        yield 100, clearance


def encodes(random):
    seed = int(random.integers(1 << 40))
    while True:
        seed += 1
        vertices, faces = random_mesh(np.random.default_rng(seed))
        size = np.linalg.norm(np.ptp(vertices, axis=0))
        low, high = vertices.min(0), vertices.max(0)
        points = (low + high) / 2 + 0.7 * (high - low) * random.uniform(-1, 1, (10, 3))
        found = tesdf.encode((vertices, faces), "fast").query(points).signed_distance
        truth = sdf(vertices, faces, points)[0]
        off = np.abs(found - truth).max() / size
        expect(off < 1e-12, f"seed {seed}: off by {off:g} of the diagonal")
        yield 1, off


def random_mesh(random):
    """a star-shaped body, from a tetrahedron to a few hundred faces, stretched"""
    vertices = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], float)
    faces = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    for _ in range(random.integers(0, 4)):
        edges = np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        edges, place = np.unique(edges, axis=0, return_inverse=True)
        middle = len(vertices) + place.reshape(3, -1).T
        vertices = np.vstack([vertices, vertices[edges].mean(1)])
        a, b, c = faces.T
        ab, bc, ca = middle.T
        faces = np.vstack([np.column_stack(f) for f in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    vertices /= np.linalg.norm(vertices, axis=1)[:, None]
    vertices *= random.uniform(0.5, 1, (len(vertices), 1)) * 10.0 ** random.uniform(-2, 0, 3)
    return vertices, faces


PARTS = {"stack": stack, "nut": nut, "worlds": worlds, "mujoco": in_mujoco, "encodes": encodes}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=0.1, help="time of each part, h; default 0.1")
    parser.add_argument("--parts", nargs="*", choices=PARTS, default=list(PARTS))
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    heading(f"tesdf {tesdf.__version__}")
    columns = ["part", "steps or meshes", "s", "worst", "memory, MB", "grew by, MB", "page faults per step or mesh", "result"]
    head(columns, ["part", "result"])
    failed = False
    for name in args.parts:
        begin, end = time.monotonic(), time.monotonic() + 3600 * args.hours
        units, worst, result = 0, 0.0, "passed"
        settled = None
        try:
            for count, off in PARTS[name](np.random.default_rng(args.seed)):
                units, worst = units + count, max(worst, off)
                now = time.monotonic()
                if settled is None and now > begin + 360 * args.hours:
                    settled = resident(), resource.getrusage(resource.RUSAGE_SELF).ru_minflt, units
                if now > end:
                    break
            grew = resident() - settled[0]
            expect(grew < GROWTH, f"memory grew by {grew / 1e6:.1f} MB")
        except OutOfBounds as error:
            result, failed = f"**{error}**", True
        settled = settled or (resident(), resource.getrusage(resource.RUSAGE_SELF).ru_minflt, 0)
        faults = (resource.getrusage(resource.RUSAGE_SELF).ru_minflt - settled[1]) / max(1, units - settled[2])
        row([name, str(units), f"{time.monotonic() - begin:.0f}", f"{worst:.1e}", f"{resident() / 1e6:.0f}",
             f"{(resident() - settled[0]) / 1e6:.1f}", f"{faults:.2f}", result])
    sys.exit(failed)


if __name__ == "__main__":
    main()
