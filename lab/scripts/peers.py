#!/usr/bin/env python3
"""Contacts of posed meshes: the peers with a Python package, and those of `tesdf-lab
peers`, on the same poses in one run.

    python -m venv VENV && VENV/bin/pip install -r lab/scripts/peers-requirements.txt
    cargo build --release --manifest-path lab/Cargo.toml
    VENV/bin/python lab/scripts/peers.py --ours lab/target/release/tesdf-lab [--json raw.json] [lab/poses/SET.json ...] > table.md

Each peer runs alone on one thread. The times are processor time for the Python peers and wall time
for `tesdf-lab`. `--ours` also gives the true clearances, from which errors are computed; without
it the error columns stay empty. A peer that is missing or fails gets a row `cannot: why`; the
script installs nothing. The peers get lengths in thousandths of the meshes' unit (millimetres),
because some have absolute tolerances. Results are in the meshes' unit.
"""
import argparse
import json
import os
import signal
import statistics
import subprocess
import time
from dataclasses import dataclass, field
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import numpy as np  # noqa: E402
from measured import ROOT, SCALE, head, heading, row, why  # noqa: E402
from meshtools import read_obj  # noqa: E402

MANY = 10**6  # more contacts than any pose has


# ------------------------------------------------------------------ input
class Pose:
    """a pose, mesh to world, in thousandths of the mesh's unit"""

    def __init__(self, text):
        numbers = np.array([float(word) for word in text.split()])
        self.t, self.q = numbers[:3] * SCALE, numbers[3:] / np.linalg.norm(numbers[3:])
        x, y, z, w = self.q
        self.wxyz = np.array([w, x, y, z])
        self.r = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ])


class PoseSet:
    """a file of lab/poses"""

    def __init__(self, path):
        data = json.loads(path.read_text())
        self.path, self.name = path, path.stem
        self.meshes = [read_obj((path.parent / data[key]).read_bytes()) for key in "ab"]
        self.meshes = [(v * SCALE, f) for v, f in self.meshes]
        self.distance = data["contact_distance"] * SCALE
        self.poses = [(Pose(p["a"]), Pose(p["b"])) for p in data["poses"]]
        vertices = self.meshes[1][0]
        self.diagonal = float(np.linalg.norm(np.ptp(vertices, axis=0))) / SCALE


# ------------------------------------------------------------------ results of a peer
@dataclass
class Found:
    """whether the solids overlap, the number of contacts, and the distance or negative depth; None
    where the operation does not report it"""

    overlap: bool | None = None
    contacts: int | None = None
    clearance: float | None = None


@dataclass
class Operation:
    """an operation of a peer: run(pose_a, pose_b) is timed, read(its result) -> Found is not"""

    name: str
    exact: str
    run: callable
    read: callable


@dataclass
class Row:
    contender: str
    operation: str
    exact: str = ""
    build: float = 0.0
    poses: list = field(default_factory=list)
    cannot: str | None = None


def measure(operation, poses, budget):
    """measures each pose up to four times and keeps the best time

    Stops when the budget, in seconds of processor time, is spent; the remaining poses are left out.
    Raises TimeoutError if the first pose takes ten times the budget of wall time."""
    outcomes, begin = [], time.process_time()

    def late(*_):
        if not outcomes:
            raise TimeoutError(f"one pose takes more than {10 * budget:g} s")

    signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, 10 * budget)
    try:
        for pair in poses:
            at_pose, best = time.process_time(), np.inf
            for _ in range(4):
                start = time.process_time()
                result = operation.run(*pair)
                best = min(best, time.process_time() - start)
                if time.process_time() - at_pose > 0.5:
                    break
            found = operation.read(result)
            clearance = None if found.clearance is None else float(found.clearance) / SCALE
            overlap = None if found.overlap is None else bool(found.overlap)
            outcomes.append(dict(seconds=best, overlap=overlap, contacts=found.contacts, clearance=clearance))
            if time.process_time() - begin > budget:
                break
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
    return outcomes


def least(distances):
    """a result from the signed distances of contacts"""
    nearest = min(distances, default=None)
    return Found(nearest is not None and nearest < 0, len(distances), nearest)


def separation(distance):
    """a result from a distance that is not positive where the surfaces intersect"""
    return Found(distance <= 0, None, distance if distance > 0 else None)


TRIANGLE_PAIRS = "no: depth of two triangles"
SURFACES = "f64; surfaces only"


# ------------------------------------------------------------------ peers: set -> operations
def fcl_operations(s):
    import fcl

    def body(vertices, faces):
        model = fcl.BVHModel()
        model.beginModel(len(vertices), len(faces))
        model.addSubModel(vertices, faces)
        model.endModel()
        return fcl.CollisionObject(model, fcl.Transform())

    bodies = [body(*mesh) for mesh in s.meshes]

    def place(*poses):
        for b, pose in zip(bodies, poses):
            b.setTransform(fcl.Transform(pose.wxyz, pose.t))

    def collide(request):
        def run(*poses):
            place(*poses)
            result = fcl.CollisionResult()
            fcl.collide(*bodies, request, result)
            return result

        return run

    def distance(*poses):
        place(*poses)
        result = fcl.DistanceResult()
        fcl.distance(*bodies, fcl.DistanceRequest(), result)
        return result

    def touching(result):
        depth = max((c.penetration_depth for c in result.contacts), default=None)
        return Found(result.is_collision, len(result.contacts), None if depth is None else -depth)

    first = fcl.CollisionRequest(num_max_contacts=1, enable_contact=False)
    every = fcl.CollisionRequest(num_max_contacts=MANY, enable_contact=True)
    return [
        Operation("collide, first pair", SURFACES, collide(first), lambda r: Found(r.is_collision)),
        Operation("collide, all contacts", TRIANGLE_PAIRS, collide(every), touching),
        Operation("distance", "f64; 0 where they overlap", distance, lambda r: separation(r.min_distance)),
    ]


def coal_operations(s):
    import coal

    def body(vertices, faces):
        model = coal.BVHModelOBBRSS()
        model.beginModel(len(faces), len(vertices))
        model.addVertices(vertices)
        model.addTriangles(faces)
        model.endModel()
        return model

    a, b = (body(*mesh) for mesh in s.meshes)

    def place(pose):
        return coal.Transform3s(coal.Quaternion(*pose.wxyz), pose.t)

    def collide(count, contacts, margin):
        request = coal.CollisionRequest(coal.CollisionRequestFlag.CONTACT, count)
        request.enable_contact = contacts
        request.security_margin = margin

        def run(pose_a, pose_b):
            result = coal.CollisionResult()
            coal.collide(a, place(pose_a), b, place(pose_b), request, result)
            return result

        return run

    def distance(pose_a, pose_b):
        result = coal.DistanceResult()
        coal.distance(a, place(pose_a), b, place(pose_b), coal.DistanceRequest(), result)
        return result

    def contacts(result):
        return least([c.penetration_depth for c in result.getContacts()])

    def touching(result):
        return Found(result.isCollision(), result.numContacts(), contacts(result).clearance)

    return [
        Operation("collide, first pair", SURFACES, collide(1, False, 0.0), lambda r: Found(r.isCollision())),
        Operation("collide, all contacts", TRIANGLE_PAIRS, collide(MANY, True, 0.0), touching),
        Operation("collide, all within the contact distance", TRIANGLE_PAIRS, collide(MANY, True, s.distance), contacts),
        Operation("distance", "f64; 0 where they overlap", distance, lambda r: separation(r.min_distance)),
    ]


def at_vertices(s, query):
    """runs query in both directions, at the vertices of each mesh that are near the other

    query(i, points in the frame of mesh i) returns their signed distances, or whether they are
    inside."""
    bounds = [(v.min(0) - s.distance, v.max(0) + s.distance) for v, _ in s.meshes]

    def run(*poses):
        answers = []
        for of, to in ((0, 1), (1, 0)):
            pose, frame = poses[of], poses[to]
            points = (s.meshes[of][0] @ pose.r.T + (pose.t - frame.t)) @ frame.r
            low, high = bounds[to]
            points = points[((points >= low) & (points <= high)).all(1)]
            answers.append(query(to, points) if len(points) else np.empty(0))
        return np.concatenate(answers)

    return run


def near(s):
    def read(distances):
        nearest = float(distances.min()) if len(distances) else None
        return Found(nearest is not None and nearest < 0, int((distances <= s.distance).sum()), nearest)

    return read


def trimesh_operations(s):
    import trimesh

    meshes = [trimesh.Trimesh(v, f, process=False) for v, f in s.meshes]
    for mesh in meshes:
        mesh.contains(mesh.bounds[:1])  # builds the tree
    only = "no: at vertices only"
    return [
        Operation(
            "contains at vertices, both ways", only,
            at_vertices(s, lambda i, points: meshes[i].contains(points)),
            lambda inside: Found(bool(inside.any()), int(inside.sum())),
        ),
        Operation(
            "signed_distance at vertices, both ways", only,
            at_vertices(s, lambda i, points: -trimesh.proximity.signed_distance(meshes[i], points)), near(s),
        ),
    ]


def open3d_operations(s):
    import open3d

    tensor = open3d.core.Tensor
    scenes = []
    for vertices, faces in s.meshes:
        scene = open3d.t.geometry.RaycastingScene(nthreads=1)
        scene.add_triangles(tensor(vertices.astype(np.float32)), tensor(faces.astype(np.uint32)))
        scenes.append(scene)

    def query(i, points):
        return scenes[i].compute_signed_distance(tensor(points.astype(np.float32)), nthreads=1).numpy()

    return [Operation("compute_signed_distance at vertices, both ways", "no: f32, at vertices only",
                      at_vertices(s, query), near(s))]


def mujoco_operations(s, depth):
    """geoms of type sdf with octrees of this depth, or of type mesh for None"""
    import mujoco

    spec = mujoco.MjSpec()
    for name, (vertices, faces) in zip("ab", s.meshes):
        mesh = spec.add_mesh(name=name)
        mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel().astype(np.int32)
        body = spec.worldbody.add_body(name=name)
        body.add_freejoint()
        body.explicitinertial, body.mass, body.inertia = True, 1, [1, 1, 1]
        kind = mujoco.mjtGeom.mjGEOM_MESH
        if depth is not None:
            mesh.needsdf, mesh.octree_maxdepth, kind = True, depth, mujoco.mjtGeom.mjGEOM_SDF
        body.add_geom(type=kind, meshname=name).margin = s.distance
    model = spec.compile()
    data = mujoco.MjData(model)
    placed = []

    def run(*poses):
        # The best run counts, and only the first run of a pose includes the kinematics.
        if placed != list(poses):
            data.qpos[:] = np.concatenate([x for pose in poses for x in (pose.t, pose.wxyz)])
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            placed[:] = poses
        mujoco.mj_collision(model, data)
        return None

    name, exact = "mj_collision, type mesh", "no: convex hulls"
    if depth is not None:
        name, exact = f"mj_collision, type sdf, octree depth {depth}", "no: interpolated in an octree, descent from 40 points"
    return [Operation(name, exact, run, lambda _: least(list(data.contact.dist)))]


def peers(depths):
    """yields name, module, distribution and operations of each peer"""
    yield "FCL", "fcl", "python-fcl", fcl_operations
    yield "Coal", "coal", "coal", coal_operations
    yield "trimesh", "trimesh", "trimesh", trimesh_operations
    yield "Open3D", "open3d", "open3d", open3d_operations
    yield "MuJoCo", "mujoco", "mujoco", lambda s: mujoco_operations(s, None)
    for depth in depths:
        yield "MuJoCo", "mujoco", "mujoco", lambda s, depth=depth: mujoco_operations(s, depth)


def rows(s, args):
    for name, module, distribution, operations in peers(args.mujoco_depths):
        try:
            import_module(module)
            start = time.process_time()
            all_operations = operations(s)
            build = time.process_time() - start
            contender = f"{name} {version(distribution)}"
        except Exception as e:  # an exception of a peer becomes its row
            yield Row(name, "", cannot=f"{type(e).__name__}: {e}")
            continue
        for operation in all_operations:
            found = Row(contender, operation.name, operation.exact, build)
            try:
                found.poses = measure(operation, s.poses, args.budget)
            except Exception as e:
                found.cannot = f"{type(e).__name__}: {e}"
            yield found


# ------------------------------------------------------------------ output
COLUMNS = ["contender", "operation", "ms per pose", "slowest", "poses", "contacts", "overlap wrong",
           "distance error", "depth error", "exact", "build, s"]


def cells(found, truth, diagonal):
    if found.cannot:
        return [found.contender, found.operation, why(found.cannot)] + [""] * 8
    times = [p["seconds"] * 1e3 for p in found.poses]
    contacts = [p["contacts"] for p in found.poses if p["contacts"] is not None]
    wrong = apart = deep = ""
    if truth:
        pairs = list(zip(found.poses, truth))
        known = [p["overlap"] == (t < 0) for p, t in pairs if p["overlap"] is not None]
        wrong = str(known.count(False)) if known else ""

        def worst(overlapping):
            errors = [abs(p["clearance"] - t) / diagonal for p, t in pairs
                      if (t < 0) == overlapping and p["clearance"] is not None]
            return f"{max(errors):.1e}" if errors else ""

        apart, deep = worst(False), worst(True)
    return [found.contender, found.operation, f"{statistics.median(times):.3g}", f"{max(times):.3g}", str(len(times)),
            f"{statistics.median(contacts):g}" if contacts else "", wrong, apart, deep, found.exact, f"{found.build:.2f}"]


def table(s, all_rows, truth):
    faces = [len(f) for _, f in s.meshes]
    print(f"**{s.name}**: {faces[0]} and {faces[1]} faces, diagonal {s.diagonal:.4g}, contact distance {s.distance / SCALE:g}", end="")
    if truth:
        overlapping = sum(t < 0 for t in truth)
        print(f"; clearance {min(truth):.3g} to {max(truth):.3g}, {overlapping} of {len(truth)} poses overlap", end="")
    print(".\n")
    head(COLUMNS, ("contender", "operation", "exact"))
    for found in all_rows:
        row(cells(found, truth, s.diagonal))
    print(flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="*", type=Path, help="default: all of lab/poses")
    parser.add_argument("--ours", metavar="BIN", help="the tesdf-lab binary: adds its rows and the true clearances")
    parser.add_argument("--json", type=Path, help="also write all measurements, one entry per pose")
    parser.add_argument("--budget", type=float, default=20, help="processor time of an operation on a set, s; default 20")
    parser.add_argument("--mujoco-depths", type=lambda t: [int(n) for n in t.split(",")], default=[6, 8],
                        help="depths of MuJoCo's octrees; default 6,8")
    args = parser.parse_args()
    paths = args.sets or sorted((ROOT / "lab/poses").glob("*.json"))
    heading()
    measured = dict.fromkeys((path.stem for path in paths), dict(clearance=None, rows=[]))
    if args.ours:
        done = subprocess.run([args.ours, "peers", *paths], stdout=subprocess.PIPE, check=True)
        measured = {found["set"]: found for found in json.loads(done.stdout)}
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    raw = []
    for s in map(PoseSet, paths):
        truth = measured[s.name]["clearance"]
        all_rows = [Row(**row) for row in measured[s.name]["rows"]] + list(rows(s, args))
        table(s, all_rows, truth)
        raw.append(dict(set=s.name, clearance=truth, rows=[vars(row) for row in all_rows]))
    if args.json:
        args.json.write_text(json.dumps(raw, indent=1) + "\n")


if __name__ == "__main__":
    main()
