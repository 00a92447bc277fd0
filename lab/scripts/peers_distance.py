#!/usr/bin/env python3
"""Signed distances of tesdf and of peers, for the same meshes and points, in one run.

    python -m venv VENV && VENV/bin/pip install -r lab/scripts/peers-requirements.txt ./python
    VENV/bin/python lab/scripts/peers_distance.py [--points N] [--checked N] [MESH.obj ...] > table.md

Each contender runs in its own process on one core, measured in processor time; with `--all-cores`
also on all cores, in wall time. Errors are relative to numpy's brute force over all faces and the
sum of their solid angles (`data/reference/make_reference.py`), which shares no code with a
contender, at the first points of each kind. A contender that is missing, fails or takes too long
gets a row `cannot: why`. The peers get lengths in millimetres.
"""
import argparse
import atexit
import functools
import multiprocessing
import os
import shutil
import tempfile
import time
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

import numpy as np
import tesdf
from measured import ROOT, SCALE, head, heading, row, why

from make_reference import sdf  # of data, which `measured` adds to the path
from meshtools import read_obj

MESHES = ["iso_m16_bolt_24k", "iso_m16_nut_c100", "spur_gear_m2_z20", "lobed_hole_c100", "shaft_keyway", "spoon", "cup_thin"]
NEAR = 0.02  # half width of the layer near the surface, as a fraction of the diagonal
SIGN_FROM = 1e-6  # signs are compared from this distance on, as a fraction of the diagonal
PASSES = 3


# ------------------------------------------------------------------ contenders: (vertices, faces, .tesdf) -> points -> signed distances
def ours(precision):
    def build(vertices, faces, file):
        asset = tesdf.Asset.open(file)
        return lambda points: asset.query(points, precision).signed_distance

    return build


def open3d(vertices, faces, _):
    import open3d

    tensor, cores = open3d.core.Tensor, len(os.sched_getaffinity(0))
    scene = open3d.t.geometry.RaycastingScene(nthreads=cores)
    scene.add_triangles(tensor(vertices.astype(np.float32)), tensor(faces.astype(np.uint32)))

    def query(points):
        return scene.compute_signed_distance(tensor(points.astype(np.float32)), nthreads=cores).numpy()

    return query


def libigl(sign):
    def build(vertices, faces, _):
        import igl

        kind = getattr(igl, f"SIGNED_DISTANCE_TYPE_{sign}")
        return lambda points: igl.signed_distance(points, vertices, faces, kind)[0]

    return build


def trimesh(vertices, faces, _):
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    return lambda points: -trimesh.proximity.signed_distance(mesh, points)


@functools.cache
def warp_kernel():
    import warp

    warp.config.log_level = warp.LOG_WARNING

    @warp.kernel(module="unique")
    def signed(mesh: warp.uint64, sign: int, points: warp.array(dtype=warp.vec3), out: warp.array(dtype=float)):
        p = points[warp.tid()]
        query = warp.mesh_query_point_sign_normal(mesh, p, 1.0e9)
        if sign == 1:
            query = warp.mesh_query_point_sign_parity(mesh, p, 1.0e9)
        if sign == 2:
            query = warp.mesh_query_point_sign_winding_number(mesh, p, 1.0e9)
        nearest = warp.mesh_eval_position(mesh, query.face, query.u, query.v)
        out[warp.tid()] = query.sign * warp.length(p - nearest)

    return signed


def warp(sign):
    def build(vertices, faces, _):
        import warp

        signed = warp_kernel()
        kind = ["normal", "parity", "winding number"].index(sign)
        indices = warp.array(faces.astype(np.int32).ravel(), dtype=int, device="cpu")
        corners = warp.array(vertices.astype(np.float32), dtype=warp.vec3, device="cpu")
        mesh = warp.Mesh(corners, indices, support_winding_number=kind == 2)

        def query(points):
            out = warp.zeros(len(points), dtype=float, device="cpu")
            at = warp.array(points.astype(np.float32), dtype=warp.vec3, device="cpu")
            warp.launch(signed, dim=len(points), inputs=[mesh.id, kind, at, out], device="cpu")
            return out.numpy()

        return query

    return build


# Name, distribution, module, results, and whether every call builds the trees again.
CONTENDERS = [
    ("tesdf f64", "tesdf", "tesdf", "distance, gradient, point, face; f64", ours("f64"), False),
    ("tesdf f32", "tesdf", "tesdf", "distance, gradient, point, face; f32", ours("f32"), False),
    ("Open3D RaycastingScene", "open3d", "open3d", "distance; f32, one ray for the sign", open3d, False),
    ("libigl pseudonormal", "libigl", "igl", "distance, point, normal, face; f64", libigl("PSEUDONORMAL"), True),
    ("libigl winding number", "libigl", "igl", "distance, point, face; f64", libigl("WINDING_NUMBER"), True),
    ("libigl fast winding number", "libigl", "igl", "distance, point, face; f64", libigl("FAST_WINDING_NUMBER"), True),
    ("Warp normal", "warp-lang", "warp", "distance, face; f32", warp("normal"), False),
    ("Warp parity", "warp-lang", "warp", "distance, face; f32", warp("parity"), False),
    ("Warp winding number", "warp-lang", "warp", "distance, face; f32", warp("winding number"), False),
    ("trimesh", "trimesh", "trimesh", "distance; f64", trimesh, False),
]


# ------------------------------------------------------------------ measuring
def seconds(clock, query, points):
    start = clock()
    query(points)
    return clock() - start


def work(name, cores, mesh, kinds, checked, budget, answer):
    """runs in its own process: the time to build, and for each kind of points the time per query
    and the first distances"""
    _, _, module, _, build, rebuilds = next(contender for contender in CONTENDERS if contender[0] == name)
    try:
        os.sched_setaffinity(0, cores)
        import_module(module)
        clock = time.process_time if len(cores) == 1 else time.perf_counter
        start = clock()
        query = build(*mesh)
        query(kinds[0][:1])  # some peers build their trees on first use
        found = [clock() - start]
        for points in kinds:
            again = min(seconds(clock, query, points[:1]) for _ in range(PASSES)) if rebuilds else 0.0
            if rebuilds:
                found[0] = again
            first = points[:checked]
            start = clock()
            distances = np.asarray(query(first), float)
            each = (clock() - start - again) / len(first)
            count = int(min(len(points), budget / max(each, 1e-9) / PASSES))
            if count > len(first):
                each = min((seconds(clock, query, points[:count]) - again) / count for _ in range(PASSES))
            found.append((each, distances))
        answer.send(found)
    except Exception as e:  # an exception of a peer becomes its row
        answer.send(why(e))


def measure(work, *arguments, limit):
    """what `work` of these arguments answers in a process of its own, or why it does not"""
    context = multiprocessing.get_context("spawn")
    receive, send = context.Pipe(duplex=False)
    child = context.Process(target=work, args=(*arguments, send))
    child.start()
    send.close()
    try:
        found = receive.recv() if receive.poll(limit) else why(f"takes more than {limit:g} s")
    except EOFError:
        child.join()
        found = why(f"its process ended with {child.exitcode}")
    child.kill()
    child.join()
    return found


def kinds_of_points(vertices, faces, count):
    """points near the surface, and uniform points in the bounding box"""
    random = np.random.default_rng(1)
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    face = random.choice(len(faces), count, p=area / area.sum())
    on = (random.dirichlet([1, 1, 1], count)[:, :, None] * corners[face]).sum(1)
    low, high = vertices.min(0), vertices.max(0)
    offset = random.uniform(-NEAR, NEAR, (count, 1)) * np.linalg.norm(high - low)
    return on + offset * normal[face] / area[face, None], random.uniform(low, high, (count, 3))


def judged(distances, truth, diagonal):
    """the errors of unsigned distances relative to the diagonal, and for each whether its sign is wrong"""
    wrong = (np.signbit(distances) != np.signbit(truth)) & (np.abs(truth) > SIGN_FROM * diagonal)
    return np.abs(np.abs(distances) - np.abs(truth)) / diagonal, wrong


def errors(distances, truth, diagonal):
    """the largest error of an unsigned distance relative to the diagonal, and the number of wrong
    signs"""
    off, wrong = judged(distances, truth, diagonal)
    return "NaN" if np.isnan(off).any() else f"{off.max():.1e}", str(wrong.sum())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="*", type=Path, help="default: those of docs/benchmarks.md")
    parser.add_argument("--points", type=int, default=100_000, help="maximum number of points of each kind; default 100000")
    parser.add_argument("--checked", type=int, default=1000, help="number of points compared with brute force; default 1000")
    parser.add_argument("--budget", type=float, default=3, help="time for the passes of a contender over one kind, s; default 3")
    parser.add_argument("--limit", type=float, default=120, help="time after which a contender is stopped, s; default 120")
    parser.add_argument("--all-cores", action="store_true", help="also on all cores, in wall time; needs an idle machine")
    args = parser.parse_args()
    spot = ROOT / "data/public/spot.obj"
    paths = args.meshes or [*(ROOT / f"data/procedural/{name}.obj" for name in MESHES), spot]
    everything, folder = os.sched_getaffinity(0), Path(tempfile.mkdtemp(prefix="tesdf-"))
    atexit.register(shutil.rmtree, folder)
    heading(", ".join(f"{name} {version(name)}" for name in dict.fromkeys(c[1] for c in CONTENDERS)))
    runs = {"ns, 1 core": {min(everything)}}
    if args.all_cores:
        runs[f"ns, {len(everything)} cores"] = everything
    columns = ["mesh", "points", "contender", "gives", *runs, "/ tesdf f64", "largest error / diagonal", "sign mistakes", "build, s"]
    head(columns, columns[:4])
    for path in paths:
        vertices, faces = read_obj(path.read_bytes())
        vertices *= SCALE
        diagonal = np.linalg.norm(np.ptp(vertices, axis=0))
        kinds = kinds_of_points(vertices, faces, args.points)
        truths = [sdf(vertices, faces, points[: args.checked])[0] for points in kinds]
        file, encoding = folder / f"{path.stem}.tesdf", time.perf_counter()
        tesdf.encode((vertices, faces)).save(file)
        encoding = time.perf_counter() - encoding
        first = None
        for name, _, _, gives, _, _ in CONTENDERS:
            found = [
                measure(work, name, cores, (vertices, faces, file), kinds, args.checked, args.budget, limit=args.limit)
                for cores in runs.values()
            ]
            one = found[0]
            if isinstance(one, str):
                row([path.stem, "", name, gives, one] + [""] * (len(columns) - 5))
                continue
            first = first or one
            building = encoding if name.startswith("tesdf") else one[0]
            for i, kind in enumerate(("near", "box"), 1):
                each, distances = one[i]
                times = [run if isinstance(run, str) else f"{run[i][0] * 1e9:.0f}" for run in found]
                row([path.stem, kind, name, gives, *times, f"{each / first[i][0]:.1f}",
                     *errors(distances, truths[i - 1], diagonal), f"{building:.2f}"])


if __name__ == "__main__":
    main()
