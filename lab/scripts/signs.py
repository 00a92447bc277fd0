#!/usr/bin/env python3
"""Wrong signs and largest errors of signed distances by tesdf and by peers, for the same meshes and points.

    python -m venv VENV && VENV/bin/pip install -r lab/scripts/peers-requirements.txt ./python
    VENV/bin/python lab/scripts/signs.py > table.md

- *references*: the meshes of `data` with distances in `data/reference`, those points.
- *tetrahedra*: random ones, regular to nearly flat, and that of NVIDIA/warp#1836; points around each.
- *fins*: wedges with sharp edges whose faces are fans of slivers, as in llnl/axom#783; points around each.
- *damaged*: closed meshes of `data` of which 1 % of the faces were removed, then each face has corners of its own;
  points at which the intact mesh has |distance| > 2 % of the diagonal. Only signs are compared.

A mesh that tesdf refuses by default, because it has no well-defined inside, is encoded by `inside="generalized"`: all
damaged ones, and six references with T-junctions.

The truth is numpy's brute force over all faces with the sum of their solid angles, which shares no code with a
contender. Vertices and points are rounded to float32 first, so that all contenders have the same input. A sign
counts where |distance| > 1e-6 of the diagonal, and an answer that is not a number counts as wrong. Each contender
runs in its own process for each set; one that fails for a mesh is counted under `no answer`.
"""
import argparse
import atexit
import csv
import shutil
import sys
import tempfile
from importlib.metadata import version

import numpy as np
import tesdf
from measured import ROOT, SCALE, head, heading, row, why
from peers_distance import CONTENDERS, judged, measure

from make_reference import sdf  # of data, which `measured` adds to the path
from meshtools import drop_bad, read_mesh, weld


# ------------------------------------------------------------------ sets: (vertices, faces, points, signed distances)
def rounded(array):
    return array.astype(np.float32).astype(float)


def around(random, vertices, count):
    """points in the box of the vertices, twice as large"""
    low, high = vertices.min(0), vertices.max(0)
    middle, size = (low + high) / 2, np.maximum(high - low, 0.1 * np.linalg.norm(high - low))
    return rounded(middle + size * random.uniform(-1, 1, (count, 3)))


def solved(vertices, faces, points):
    return vertices, faces, points, sdf(vertices, faces, points)[0]


def references(_):
    for file in sorted((ROOT / "data/reference").glob("*.csv")):
        name = file.stem.removesuffix("_near")
        path = next((p for p in (ROOT / "data").glob(f"p*/{name}.*") if p.suffix in (".obj", ".stl")), None)
        if path is None:
            continue
        with open(file) as lines:
            points = rounded(SCALE * np.array([[float(v) for v in r[:3]] for r in list(csv.reader(lines))[1:]]))
        vertices, faces = drop_bad(*weld(*read_mesh(str(path))[:2]))
        yield solved(rounded(SCALE * vertices), faces, points)


def tetrahedra(random):
    faces = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]])
    corner = np.vstack([np.zeros(3), np.eye(3)])
    yield solved(corner, faces, around(random, corner, 400))
    for k in range(200):
        vertices = random.normal(size=(4, 3))
        vertices[:, 2] *= 10.0 ** -random.uniform(0, 4)
        vertices = rounded(vertices)
        a, b, c, d = vertices
        turned = faces if np.dot(np.cross(b - a, c - a), d - a) > 0 else faces[:, ::-1]
        yield solved(vertices, turned, around(random, vertices, 50))


def fins(random):
    """a prism over a thin triangle, whose sharp edge is divided unevenly on one side only"""
    for k in range(40):
        angle, parts = np.radians(random.uniform(1, 20)), int(random.integers(2, 12))
        at = np.cumsum(10.0 ** random.uniform(-3, 0, parts + 1))
        at = (at - at[0]) / (at[-1] - at[0])
        edge = np.column_stack([np.zeros(parts + 1), at, np.zeros(parts + 1)])
        far = np.array([[np.cos(angle), y, s * np.sin(angle)] for y in (0, 1) for s in (1, -1)])
        vertices = rounded(np.vstack([edge, far]))
        n = parts + 1
        up0, down0, up1, down1 = n, n + 1, n + 2, n + 3
        top = [[i, up0, i + 1] for i in range(parts)] + [[parts, up0, up1]]
        bottom = [[i + 1, down1, i] for i in range(parts)] + [[0, down1, down0]]
        rest = [[0, down0, up0], [parts, up1, down1], [up0, down0, down1], [up0, down1, up1]]
        faces = np.array(top + bottom + rest)
        a, b, c = (vertices[faces[:, i]] for i in range(3))
        if np.einsum("ij,ij->", a, np.cross(b, c)) < 0:
            faces = faces[:, ::-1]
        yield solved(vertices, faces, around(random, vertices, 200))


def damaged(random):
    for name in ("cube", "l_bracket", "torus_5k", "chain_link", "lobed_peg", "shaft_keyway", "iso_m16_nut_c100", "iso_m16_bolt_6k"):
        vertices, faces = read_mesh(str(ROOT / f"data/procedural/{name}.obj"))[:2]
        vertices = rounded(SCALE * vertices)
        points = around(random, vertices, 400)
        distance = sdf(vertices, faces, points)[0]
        far = np.abs(distance) > 0.02 * np.linalg.norm(np.ptp(vertices, axis=0))
        left = np.delete(faces, random.choice(len(faces), max(1, len(faces) // 100), replace=False), axis=0)
        soup = vertices[left].reshape(-1, 3)
        yield soup, np.arange(len(soup)).reshape(-1, 3), points[far], distance[far]


SETS = {"references": references, "tetrahedra": tetrahedra, "fins": fins, "damaged": damaged}


# ------------------------------------------------------------------ measuring
def encoded(which, cases, folder):
    """the files of tesdf"""
    for k, (vertices, faces, *_) in enumerate(cases):
        try:
            asset = tesdf.encode((vertices, faces), "fast")
        except tesdf.NotSolidError:
            asset = tesdf.encode((vertices, faces), "fast", inside="generalized")
        asset.save(f"{folder}/{which}-{k}.tesdf")
        yield f"{folder}/{which}-{k}.tesdf"


def work(name, cases, files, answer):
    """runs in its own process"""
    build = next(contender[4] for contender in CONTENDERS if contender[0] == name)
    points = wrong = refused = 0
    worst = 0.0
    for k, ((vertices, faces, at, truth), file) in enumerate(zip(cases, files)):
        try:
            distances = np.asarray(build(vertices, faces, file)(at), float)
        except Exception as error:
            refused += 1
            print(f"{name}, {k}: {why(error)}", flush=True, file=sys.stderr)
            continue
        off, is_wrong = judged(distances, truth, np.linalg.norm(np.ptp(vertices, axis=0)))
        is_wrong |= np.isnan(distances)
        points, wrong = points + len(at), wrong + int(is_wrong.sum())
        worst = max(worst, np.nanmax(off, initial=0.0))
    answer.send((points, wrong, worst, refused))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", nargs="*", choices=SETS, default=list(SETS))
    parser.add_argument("--limit", type=float, default=900, help="time after which a contender is stopped, s; default 900")
    args = parser.parse_args()
    heading(", ".join(f"{name} {version(name)}" for name in dict.fromkeys(c[1] for c in CONTENDERS)))
    head(["set", "meshes", "contender", "points", "wrong signs", "largest error / diagonal", "no answer"], ["set", "contender"])
    folder = tempfile.mkdtemp(prefix="tesdf-")
    atexit.register(shutil.rmtree, folder)
    for which in args.sets:
        cases = list(SETS[which](np.random.default_rng(1)))
        files = list(encoded(which, cases, folder))
        for name, *_ in CONTENDERS:
            found = measure(work, name, cases, files, limit=args.limit)
            if isinstance(found, str):
                row([which, str(len(cases)), name, found, "", "", ""])
                continue
            points, wrong, worst, refused = found
            error = "" if which == "damaged" else f"{worst:.1e}"
            row([which, str(len(cases)), name, str(points), str(wrong), error, str(refused)])


if __name__ == "__main__":
    main()
