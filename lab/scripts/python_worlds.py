#!/usr/bin/env python3
"""Compares a batch of scenes in Python with the same batch in Rust, in turns on one machine: each
world has a hole and a peg, which all move in each pass.

    cargo build --release --bin tesdf
    python -m venv VENV && VENV/bin/pip install ./python
    VENV/bin/python lab/scripts/python_worlds.py --rust lab/target/release/tesdf-lab [--worlds N] > table.md

Rust: `Scene::set_poses` and `detect`, by `tesdf-lab worlds`. Python: `Scene.update` with an array
[N, 7], and `Scene.detect`, which returns an array for each field.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import tesdf
from measured import ROOT, head, heading, row

PASSES = 5
DISTANCE = 1e-4  # m; contacts up to this distance

# Runs in its own process, as Rust does.
PYTHON = f"""
import json, sys, time
import numpy as np, tesdf
fixed, moving, poses, mode, threads = sys.argv[1:]
poses = np.fromfile(poses).reshape(-1, 7)
worlds, rest = np.arange(len(poses)), np.tile([0.0, 0, 0, 0, 0, 0, 1], (len(poses), 1))
scene = tesdf.Scene()
scene.add_many(scene.add_shape(tesdf.Asset.open(fixed)), rest, world=worlds)
ids = scene.add_many(scene.add_shape(tesdf.Asset.open(moving)), rest, world=worlds)
def step():
    start = time.perf_counter()
    scene.update(ids, poses=poses)
    found = scene.detect(mode=mode, contact_distance={DISTANCE}, threads=int(threads))
    return time.perf_counter() - start, found
seconds, found = min((step() for _ in range({PASSES})), key=lambda done: done[0])
print(json.dumps({{"seconds": seconds, "contacts": len(found), "least": found.distance.min()}}))
"""


def output(*command):
    return json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rust", required=True, help="the tesdf-lab binary")
    parser.add_argument("--worlds", type=int, default=1000, help="number of worlds; default 1000")
    parser.add_argument("--rounds", type=int, default=3, help="number of rounds of Rust and Python; the best counts; default 3")
    parser.add_argument("--modes", nargs="+", default=["node", "exact"], help="what is tested; default node exact")
    args = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    random = np.random.default_rng(1)
    poses = np.zeros((args.worlds, 7))
    poses[:, :2] = random.uniform(-1e-4, 1e-4, (args.worlds, 2))
    poses[:, 2] = random.uniform(5e-3, 40e-3, args.worlds)
    turn = random.uniform(-0.02, 0.02, args.worlds)
    poses[:, 5], poses[:, 6] = np.sin(turn / 2), np.cos(turn / 2)
    heading(f"tesdf {tesdf.__version__}, numpy {np.__version__}; {args.worlds} worlds, each with a hole and a peg")
    head(["mode", "threads", "contacts", "Rust, s", "Python, s", "Python / Rust"], ["mode"])
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder, name) for name in ("hole.tesdf", "peg.tesdf", "poses.f64")]
        for file, mesh in zip(files, ("lobed_hole_c100", "lobed_peg")):
            tesdf.encode(ROOT / "data" / "procedural" / f"{mesh}.obj", "fast").save(file)
        poses.tofile(files[2])
        for mode in args.modes:
            for threads in dict.fromkeys((1, cores)):
                options = ["--poses", files[2], "--mode", mode, "--contact-distance", str(DISTANCE), "--passes", str(PASSES)]
                turns = [
                    (output(args.rust, "worlds", *files[:2], *options, "--threads", str(threads)),
                     output(sys.executable, "-c", PYTHON, *files, mode, str(threads)))
                    for _ in range(args.rounds)
                ]
                same = {(found["contacts"], found["least"]) for turn in turns for found in turn}
                assert len(same) == 1, same
                rust, python = (min(turn[side]["seconds"] for turn in turns) for side in (0, 1))
                row([mode, str(threads), str(turns[0][0]["contacts"]), f"{rust:.4f}", f"{python:.4f}", f"{python / rust:.2f}"])


if __name__ == "__main__":
    main()
