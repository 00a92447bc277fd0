#!/usr/bin/env python3
"""Compares a batch of queries from Python with the same batch in Rust: the same asset and points,
in turns on one machine.

    cargo build --release --manifest-path lab/Cargo.toml
    python -m venv VENV && VENV/bin/pip install ./python
    VENV/bin/python lab/scripts/python_batch.py --rust lab/target/release/tesdf-lab [--points N] [MESH.obj or .tesdf ...] > table.md

Rust: `query_batch` over points in memory, by `tesdf-lab batch`. Python: `Asset.query` of an array
[N, 3], which returns four new arrays.
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

# Runs in its own process, because the first query fixes the number of threads.
PYTHON = f"""
import json, sys, time
import numpy as np, tesdf
asset, points = tesdf.Asset.open(sys.argv[1]), np.fromfile(sys.argv[2]).reshape(-1, 3)
def seconds(precision):
    start = time.perf_counter()
    asset.query(points, precision)
    return time.perf_counter() - start
def best(precision):
    seconds(precision)
    return min(seconds(precision) for _ in range({PASSES}))
print(json.dumps({{p: best(p) for p in ("f32", "f64")}}))
"""


def output(*command, threads):
    environment = {**os.environ, "RAYON_NUM_THREADS": str(threads)}
    return json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True, env=environment).stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="*", type=Path, default=[ROOT / "data/procedural/iso_m16_bolt_24k.obj"])
    parser.add_argument("--rust", required=True, help="the tesdf-lab binary")
    parser.add_argument("--points", type=int, default=1_000_000, help="number of points; default 10^6")
    parser.add_argument("--rounds", type=int, default=3, help="number of rounds of Rust and Python; the best counts; default 3")
    args = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    heading(f"tesdf {tesdf.__version__}, numpy {np.__version__}")
    head(["mesh", "points", "precision", "threads", "Rust, s", "Python, s", "Python / Rust"], ["mesh", "points", "precision"])
    for mesh in args.meshes:
        with tempfile.TemporaryDirectory() as folder:
            file, points = Path(folder, "a.tesdf"), Path(folder, "points.f64")
            asset = tesdf.Asset.open(mesh) if mesh.suffix == ".tesdf" else tesdf.encode(mesh)
            asset.save(file)
            random, (low, high) = np.random.default_rng(1), asset.bounds
            box = random.uniform(low, high, (args.points, 3))
            found = asset.query(box, "f32")
            near = found.closest_point + random.uniform(-0.02, 0.02, (args.points, 1)) * asset.statistics.diagonal * found.gradient
            for kind, array in (("near", near), ("box", box)):
                array.tofile(points)
                for threads in dict.fromkeys((1, cores)):
                    turns = [
                        (output(args.rust, "batch", file, points, "--threads", str(threads), threads=threads),
                         output(sys.executable, "-c", PYTHON, file, points, threads=threads))
                        for _ in range(args.rounds)
                    ]
                    for precision in ("f32", "f64"):
                        rust, python = (min(turn[side][precision] for turn in turns) for side in (0, 1))
                        row([mesh.stem, kind, precision, str(threads), f"{rust:.3f}", f"{python:.3f}", f"{python / rust:.2f}"])


if __name__ == "__main__":
    main()
