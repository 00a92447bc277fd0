"""Contacts against the command `tesdf`, formulas and signed distances; clearance, time of impact and
reports."""

import inspect
import json
import os
import subprocess
import threading

import numpy as np
import pytest
import tesdf
from ctrl_c import ended_by_ctrl_c
from test_scene import IDENTITY, balls, random_poses

# B is turned about x by a quarter, so that the tori are like links of a chain, and touch.
LINKED = [0.72, 0.05, 0.02, 0.5**0.5, 0, 0, 0.5**0.5]
KINDS = {"vertex": 0, "edge": 1, "face": 2}


@pytest.fixture
def linked(asset):
    scene = tesdf.Scene()
    part = scene.add_shape(asset)
    scene.add(part)
    scene.add(part, LINKED)
    return scene


@pytest.fixture(scope="module")
def file(asset, tmp_path_factory):
    path = tmp_path_factory.mktemp("torus") / "torus.tesdf"
    asset.save(path)
    return path


def command(name, file, *options):
    """The JSON that a command prints for A and, at the pose LINKED, B."""
    program = os.environ.get("TESDF_CLI")
    assert program, "TESDF_CLI must name the program tesdf, as .ci/python.sh builds it"
    pose = " ".join(map(repr, LINKED))
    run = [program, name, file, file, "--pose-b", pose, "--json", *options]
    return json.loads(subprocess.run(run, stdout=subprocess.PIPE, check=True).stdout)


def same(found, expected):
    """Whether an array has the bits of a column of JSON. Python prints and reads floats without loss."""
    expected = np.asarray(expected, found.dtype).reshape(found.shape)
    return np.array_equal(found.view(np.uint8), expected.view(np.uint8))


OPTIONS = [
    {},
    {"mode": "node"},
    {"mode": "face", "contacts_per": "cell", "iterations": 16, "cos_theta": 0.5},
    {"contacts_per": "minimum", "contact_distance": 0.05, "tolerance": 1e-6},
    {"contact_distance": 0.05, "reduce": 5},
    {"contact_distance": 0.05, "spread": 4},
]


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_contacts_are_those_of_the_command(asset, file, linked, options):
    found = tesdf.collide(asset, asset, pose_b=LINKED, **options)
    flags = [text for name, value in options.items() for text in ("--" + name.replace("_", "-"), str(value))]
    expected = command("collide", file, "--report", *flags)
    contacts = expected["contacts"]
    assert len(found) == len(contacts) > (0 if options.get("spread") else 4)
    for name in ("point_a", "point_b", "normal", "distance", "face_a", "face_b", "instance_a", "instance_b", "converged"):
        assert same(getattr(found, name), [c[name] for c in contacts]), name
    assert same(found.tet_b, [tesdf.NO_CELL if c["tet_b"] is None else c["tet_b"] for c in contacts])
    assert same(found.feature_a, [c["feature"]["a"] for c in contacts])
    for kind, ids, contact in zip(found.feature_b_kind, found.feature_b.tolist(), contacts):
        [(name, of_b)] = contact["feature"]["b"].items()
        assert kind == KINDS[name] and ids == (of_b if name == "edge" else [of_b, tesdf.NO_CELL])
    touching = linked.touching_features(found)
    for kinds, ids, name in ((touching.a_kind, touching.a, "a"), (touching.b_kind, touching.b, "b")):
        for kind, row, contact in zip(kinds, ids.tolist(), contacts):
            [(of, names)] = contact["touching_features"][name].items()
            assert kind == KINDS[of] and row == (names if of == "edge" else [names, tesdf.NO_CELL])
    assert vars(found.statistics) == expected["statistics"]
    for rows, name in ((found.reductions, "reductions"), (found.hidden, "hidden")):
        assert len(rows) == len(expected[name]) and (name == "hidden" or len(rows) == ("mode" not in options and len(options) == 2))
        for field, column in vars(rows).items():
            assert same(column, [np.nan if row[field] is None else row[field] for row in expected[name]]), field


def test_measures_are_those_of_the_command(asset, file):
    near = dict(a=asset, b=asset, pose_b=LINKED)
    motion = [0.5, -0.1, 0.2, 0.1, 0.2, 0.3]
    far = [5, 0, 0, 0, 0, 0, 1]
    for tolerance in (None, 1e-4):
        flags = [] if tolerance is None else ["--tolerance", str(tolerance)]
        expected = command("clearance", file, *flags)
        found = tesdf.clearance(**near, tolerance=tolerance)
        assert found.distance < 0 and found.overlap and json.loads(json.dumps(vars(found))) == expected
    away = ["--pose-a", " ".join(map(str, far))]
    velocity = ["--velocity-a", " ".join(map(str, [-x for x in motion]))]
    expected = command("toi", file, *away, *velocity, "--end", "9")
    assert expected.pop("end") == 9
    found = tesdf.time_of_impact(asset, asset, pose_a=far, pose_b=LINKED, velocity_a=-np.array(motion), end=9)
    assert found.touches and 0 < found.time < 9 and json.loads(json.dumps(vars(found))) == expected
    screw = [0, 0, 0, 1, 0, 0, 2, -6]
    expected = command("toi", file, *away, "--screw-a", " ".join(map(str, screw)))
    assert expected.pop("end") == 1
    found = tesdf.time_of_impact(asset, asset, pose_a=far, pose_b=LINKED, screw_a=screw)
    assert found.touches and json.loads(json.dumps(vars(found))) == expected
    [expected, _] = command("collide", file, "--why")
    found = tesdf.why(asset, asset, pose_b=LINKED)
    assert (found.pair, found.total, found.candidates) == ("tested", expected["total"], expected["candidates"])
    assert [part.id for part in found.parts] == [part["id"] for part in expected["parts"]]
    distances = [[p.distance for p in part.polygons] for part in found.parts]
    assert distances == [[p["distance"] for p in part["polygons"]] for part in expected["parts"]]


@pytest.mark.parametrize("mode", ["node", "face", "exact"])
def test_contacts_have_the_signed_distance_of_the_field(asset, torus, mode):
    # Body a is where its mesh is, so its field can be asked at points of the world.
    tolerance = {} if mode == "node" else {"tolerance": 1e-9}
    found = tesdf.collide(asset, asset, pose_b=LINKED, mode=mode, contact_distance=0.03, **tolerance)
    of_field = found.instance_b == 0
    assert 3 < of_field.sum() < len(found)
    points = found.point_a[of_field]
    answers = asset.query(points)
    assert np.abs(answers.signed_distance - found.distance[of_field]).max() < 1e-13
    offset = found.point_b - found.point_a + found.normal * found.distance[:, None]
    assert np.abs(offset).max() < 1e-12 and np.abs(np.linalg.norm(found.normal, axis=1) - 1).max() < 1e-9
    assert (found.distance <= 0.03).all() and (found.distance < 0).any()
    # point_a is on face_a, of body b where b has the face.
    vertices, faces = torus
    rotation = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    corners = vertices[faces[found.face_a[of_field]]] @ rotation.T + LINKED[:3]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    assert np.abs(((points - corners[:, 0]) * normals).sum(1)).max() < 1e-12


def test_threads_change_nothing(asset):
    scene = tesdf.Scene()
    spread = [3, 3, 3, 1, 1, 1, 1]
    scene.add_many(scene.add_shape(asset), spread * random_poses(12))
    scene.add_many(scene.add_shape(tesdf.Capsule(0.5, 0.2)), spread * random_poses(12, seed=2))
    for options in ({}, {"mode": "node"}, {"reduce": 4}):
        one, two = (scene.detect(threads=n, **options) for n in (1, 2))
        assert len(one) > 50 and one.statistics == two.statistics
        for a, b in zip((one, one.reductions, one.hidden), (two, two.reductions, two.hidden)):
            assert all(same(x, getattr(b, name)) for name, x in vars(a).items() if isinstance(x, np.ndarray))
    keys = np.stack([one.instance_a, one.instance_b], 1).tolist()
    assert one.arrays().keys() == {n for n, x in vars(one).items() if isinstance(x, np.ndarray)} and len(keys) == len(one)


def test_a_thousand_spheres():
    # A grid of 10 x 10 x 10 unit spheres. Neighbours along an axis overlap by 0.1.
    grid = 1.9 * np.stack(np.meshgrid(*[range(10)] * 3, indexing="ij"), -1).reshape(-1, 3)
    scene, ids = balls(grid)
    found = scene.detect()
    assert len(ids) == 1000 and len(found) == 2 * 3 * 10 * 10 * 9
    assert np.abs(found.distance + 0.1).max() < 1e-12
    between = grid[found.instance_a] - grid[found.instance_b]
    assert np.abs(found.normal - between / 1.9).max() < 1e-12
    assert np.abs(found.point_a - grid[found.instance_a] + found.normal).max() < 1e-12
    assert np.abs(found.point_b - grid[found.instance_b] - found.normal).max() < 1e-12
    apart = np.hstack([grid * 1.2, np.tile([0, 0, 0, 1.0], (1000, 1))])
    scene.update(ids, poses=apart)
    assert len(scene.detect()) == 0
    velocities = np.zeros((1000, 6))
    velocities[:, 0] = 3 * (-1.0) ** (ids // 100)  # relative to neighbours along x: 6
    scene.update(ids, velocities=velocities)
    assert len(scene.detect(speculative_time=0.04)) == 0
    assert len(scene.detect(speculative_time=0.05)) == 2 * 9 * 100
    # The same spheres at half the size in one world of two.
    scene.update(ids, poses=apart * [0.5, 0.5, 0.5, 1, 1, 1, 1], scale=0.5, world=ids % 2, velocities=np.zeros((1000, 6)))
    assert len(scene.detect(contact_distance=0.15)) == 2 * 2 * 10 * 10 * 9


def test_scenes_without_contacts(asset):
    scene = tesdf.Scene()
    empty = scene.detect()
    part = scene.add_shape(asset)
    scene.add(part)
    alone = scene.detect(mode="node")
    scene.add(part, [1e6, 0, 0, 0, 0, 0, 1])
    scene.add_many(scene.add_shape(tesdf.Plane()), np.tile(IDENTITY, (2, 1)), world=1)  # planes never meet
    for found in (empty, alone, scene.detect(contact_distance=0.1), scene.detect(reduce=3)):
        assert len(found) == len(found.reductions) == len(found.hidden) == 0 and not found
        assert found.point_a.shape == (0, 3) and found.feature_b.shape == (0, 2) and found.converged.dtype == bool
    assert found.statistics.instance_pairs == 0 and repr(found) == "<tesdf.Contacts: 0 contacts>"


def test_bodies_in_the_same_pose_overlap(asset):
    found = tesdf.collide(asset, asset, mode="node")
    assert len(found.hidden) == 1 and found.hidden.depth[0] > 0.1 and "1 hidden overlap" in repr(found)
    assert found.hidden.instance_a.tolist() == [0] and found.hidden.instance_b.tolist() == [1]
    assert tesdf.clearance(asset, asset).overlap


def test_coarse_contacts():
    # Two equal boxes on top of each other, one turned: no vertex of one is on the other.
    scene, turn = tesdf.Scene(), np.radians(45)
    box = scene.add_shape(tesdf.Box([1, 1, 1]))
    scene.add(box)
    scene.add(box, [0, 0, 1.999, 0, 0, np.sin(turn / 2), np.cos(turn / 2)])
    assert len(scene.detect(mode="node")) == 0
    coarse = scene.coarse_contacts()
    assert list(zip(coarse.instance_a, coarse.instance_b)) == [(0, 1), (1, 0)]
    assert coarse.distance == pytest.approx([-0.001] * 2) and (coarse.corner_reach > 0.5).all()
    assert len(scene.detect()) > 8


def test_clearance_of_simple_shapes():
    scene, _ = balls([[0, 0, 0], [5, 0, 0], [5, 1, 0]])
    found = scene.clearance(0, 1)
    assert found.distance == 3 and found.point_a == (1, 0, 0) and found.point_b == (4, 0, 0) and found.normal == (-1, 0, 0)
    assert found.converged and not found.overlap
    assert scene.clearance(2, 1).distance == pytest.approx(-1) and scene.clearance(2, 1).overlap
    plane = tesdf.clearance(tesdf.Capsule(half_height=1, radius=0.25), tesdf.Plane(), pose_a=[0, 0, 3, 0, 0, 0, 1])
    assert plane.distance == 1.75
    plane = tesdf.clearance(tesdf.Cylinder(half_height=1, radius=0.25), tesdf.Plane(), pose_a=[0, 0, 3, 0, 0, 0, 1])
    assert plane.distance == 2 and plane.point_a[2] == 2
    for a, b, text in ((0, 0, "one and the same"), (0, 9, "instance 9 is not in the scene")):
        with pytest.raises(tesdf.CollideError, match=text):
            scene.clearance(a, b)
    with pytest.raises(tesdf.CollideError, match="tolerance is 0; expected a finite number greater than 0"):
        scene.clearance(0, 1, tolerance=0)
    with pytest.raises(tesdf.CollideError, match="no clearance: both are planes"):
        tesdf.clearance(tesdf.Plane(), tesdf.Plane())


def test_clearance_of_meshes(asset, torus):
    # The least distance over dense points of the surface is an upper bound, and near it.
    vertices, faces = torus
    weights = np.stack(np.meshgrid(*[np.linspace(0, 1, 9)] * 2), -1).reshape(-1, 2)
    weights = weights[weights.sum(1) <= 1]
    weights = np.column_stack([weights, 1 - weights.sum(1)])
    points = np.einsum("wc,fcx->fwx", weights, vertices[faces]).reshape(-1, 3)
    for pose in random_poses(4):
        pose[0] += 3.0
        found = tesdf.clearance(asset, asset, pose_b=pose)
        x, y, z, w = pose[3:]
        v = np.array([x, y, z])
        turned = points + 2 * np.cross(v, np.cross(v, points) + w * points) + pose[:3]
        least = asset.signed_distance(turned).min()
        assert -1e-9 <= least - found.distance < 0.01


def test_time_of_impact_of_simple_shapes():
    scene, _ = balls([[0, 0, 5], [4, 0, 5]])
    floor = scene.add(scene.add_shape(tesdf.Plane()))
    found = scene.time_of_impact(0, floor, velocity_a=[0, 0, -8, 0, 0, 0])
    assert found.time == pytest.approx(0.5, abs=1e-6) and found.touches and 0 <= found.distance < 1e-5
    assert scene.time_of_impact(0, floor, velocity_a=[0, 0, -8, 0, 0, 0], end=0.4) is None
    assert scene.time_of_impact(0, 1) is None
    both = scene.time_of_impact(0, 1, velocity_a=[1, 0, 0, 0, 0, 0], velocity_b=[-1, 0, 0, 0, 0, 0])
    assert both.time == pytest.approx(1, abs=1e-6)
    screw = scene.time_of_impact(0, floor, screw_a=[0, 0, 0, 0, 0, 1, 2 * np.pi, -8], end=1)
    assert screw.time == pytest.approx(0.5, abs=1e-6)
    unknown = scene.time_of_impact(0, floor, velocity_a=[0, 0, -8, 0, 0, 0], iterations=0)
    assert (unknown.verdict, unknown.time, unknown.touches) == ("undecided", None, False)
    assert 0 <= unknown.free_until < 0.5 and found.verdict == "impact" and found.free_until == found.time
    several = scene.times_of_impact([[0, floor]] * 2, velocities_a=[[0, 0, -8, 0, 0, 0], [1, 0, 0, 0, 0, 0]], iterations=0)
    assert np.isnan(several.time[0]) and several.time[1] == np.inf
    assert several.decided.tolist() == [False, True] and several.free_until.tolist() == [unknown.free_until, 1]
    for keywords, error, text in (
        (dict(velocity_a=[1, 2, 3]), ValueError, r"velocity_a: .*\(3,\); expected shape \(6,\), vx vy vz wx wy wz"),
        (dict(screw_b=[1, 2, 3]), ValueError, r"screw_b: .*\(3,\); expected shape \(8,\), px py pz"),
        (dict(screw_a=[0, 0, 0, 0, 0, 0, 1, 1]), tesdf.CollideError, "screw axis .*; expected a direction"),
        (dict(velocity_a=[0] * 6, screw_a=[0] * 8), ValueError, "velocity_a: given together with screw_a"),
        (dict(velocity_a=[np.nan] * 6), tesdf.CollideError, "velocity"),
        (dict(velocity_b=[0, 0, 0, 1, 0, 0]), tesdf.CollideError, "a plane that turns"),
        (dict(end=-1), tesdf.CollideError, "end is -1; expected a finite time"),
    ):
        with pytest.raises(error, match=text):
            scene.time_of_impact(0, floor, **keywords)


def test_why_agrees_with_the_contacts(asset):
    scene = tesdf.Scene()
    part = scene.add_shape(asset)
    scene.add(part)
    scene.add(part, LINKED)
    scene.add(part, [9, 0, 0, 0, 0, 0, 1], world=1)
    found = scene.detect(contacts_per="cell", cos_theta=0.5)
    report = scene.why(1, 0, contacts_per="cell", cos_theta=0.5)
    verdicts = [(part.id, p.distance) for part in report.parts for p in part.polygons if p.verdict == "contact"]
    of_pair = (found.instance_a == 1) & (found.instance_b == 0)
    assert sorted(verdicts) == sorted(zip(found.face_a[of_pair].tolist(), found.distance[of_pair].tolist()))
    assert any(p.verdict == "filtered" and p.cosine > -0.5 for part in report.parts for p in part.polygons)
    assert report.total == 600 and report.candidates == len(report.parts)
    [one] = scene.why(1, 0, int(found.face_a[of_pair][0])).parts
    assert one.broad == "candidate" and one.bound is None
    assert scene.why(0, 2).pair == "other_worlds" and scene.why(0, 0).pair == "same_instance"
    far = scene.why(0, 1, int(np.argmax(asset.vertices[asset.faces].mean(1)[:, 0] < -1.3)))
    assert far.parts[0].broad.startswith("pruned") and far.parts[0].bound > 0
    with pytest.raises(tesdf.CollideError, match=r"face is 600 \(of 600\); expected a face of the body"):
        scene.why(0, 1, 600)


@pytest.mark.parametrize("options, error, text", [
    ({"mode": "nodes"}, ValueError, "mode: 'nodes'; expected 'node', 'face' or 'exact'"),
    ({"mode": 3}, ValueError, "mode: int; expected 'node'"),
    ({"contacts_per": "vertex"}, ValueError, "contacts_per: 'vertex'; expected 'cell', 'face' or 'minimum'"),
    ({"precision": "f16"}, ValueError, "precision: 'f16'; expected 'f64' or 'f32'"),
    ({"distance": 0.1}, TypeError, "has no keyword 'distance'; expected mode, contacts_per, contact_distance"),
    ({"contact_distance": "far"}, ValueError, "contact_distance: str; expected a number"),
    ({"contact_distance": -1.0}, tesdf.CollideError, "contact_distance is -1e0; expected 0 to 1e50"),
    ({"contact_distance": float("nan")}, tesdf.CollideError, "contact_distance is NaN"),
    ({"cos_theta": 2}, tesdf.CollideError, "cos_theta is 2; expected -1 to 1"),
    ({"tolerance": 0}, tesdf.CollideError, "tolerance is 0"),
    ({"mode": "face", "iterations": 10**6}, tesdf.CollideError, "iterations is 1000000"),
    ({"iterations": -1}, ValueError, "iterations: -1; expected an integer from 0"),
    ({"mode": "node", "contacts_per": "face"}, tesdf.CollideError, "contacts_per has no effect in the mode `node`"),
    ({"iterations": 16}, tesdf.CollideError, "iterations has no effect in the mode `exact`, only in `face`"),
    ({"reduce": 0}, tesdf.CollideError, "reduction is 0 contacts per pair"),
    ({"reduce": 4, "spread": 4}, ValueError, "spread: given together with reduce; expected one of them"),
    ({"threads": 0}, ValueError, "threads: 0; expected an integer greater than 0"),
    ({"threads": 10000}, ValueError, "threads: 10000; expected at most 1024"),
])
def test_invalid_options_are_errors(options, error, text):
    scene, _ = balls([[0, 0, 0], [1, 0, 0]])
    with pytest.raises(error, match=text):
        scene.detect(**options)
    with pytest.raises(error, match=text):
        tesdf.collide(tesdf.Sphere(1), tesdf.Sphere(1), **options)


def test_signatures_have_the_defaults(linked):
    with pytest.raises(TypeError):
        linked.detect(True)
    expected = linked.detect()
    for method in (linked.detect, linked.why, linked.coarse_contacts):
        parameters = inspect.signature(method).parameters.values()
        defaults = {p.name: p.default for p in parameters if p.kind is p.KEYWORD_ONLY}
        assert len(defaults) == (12 if "device" in defaults else 11)
        assert same(linked.detect(**defaults).distance, expected.distance)
    assert defaults.keys() < inspect.signature(linked.detect).parameters.keys() >= {"device"}
    parameters = inspect.signature(tesdf.InstancePairs.detect).parameters
    assert {name: parameters[name].default for name in defaults} == defaults and len(parameters) == 14


def test_bodies_of_two_functions(asset, torus):
    with pytest.raises(ValueError, match="b: an asset in mm, and a is in m; expected assets in one unit"):
        tesdf.collide(asset, tesdf.encode(torus, "fast", unit="mm"))
    with pytest.raises(tesdf.CollideError, match="pose_b: not a pose"):
        tesdf.collide(asset, asset, pose_b=[0] * 7)
    with pytest.raises(ValueError, match="a: int; expected an Asset"):
        tesdf.clearance(17, asset)
    on_floor = tesdf.collide(tesdf.Sphere(1), tesdf.Plane(), pose_a=[0, 0, 0.75, 0, 0, 0, 1])
    assert set(on_floor.distance) == {-0.25} and set(on_floor.tet_b) == {tesdf.NO_CELL}
    assert on_floor.normal[on_floor.instance_b == 1].tolist() == [[0, 0, 1]]


def test_a_detection_keeps_the_scene_that_it_began_with(asset):
    scene = tesdf.Scene()
    ids = scene.add_many(scene.add_shape(asset), random_poses(5))
    expected, found, ends = scene.detect(), [], threading.Event()
    def detect():
        found.append(scene.detect(threads=1))
        ends.set()
    thread = threading.Thread(target=detect)
    thread.start()
    changes = 0
    while not ends.is_set():
        scene.update(ids, scale=1 + changes % 2)
        changes += 1
    thread.join()
    # The interpreter's lock is free during a detection.
    assert changes > 3 and len(found[0]) > 0
    scene.update(ids, scale=1)
    assert same(scene.detect().distance, expected.distance)


def test_ctrl_c_ends_a_detection(file):
    # Each of these pairs takes some milliseconds, and there are 45 thousand.
    body = [
        "scene, asset = tesdf.Scene(), tesdf.Asset.open(sys.argv[1])",
        "poses = [[1e-3 * k, 0, 0, 0, 0, 0, 1] for k in range(300)]",
        "scene.add_many(scene.add_shape(asset), poses)",
        "print('started', flush=True)",
        "scene.detect(tolerance=1e-9)",
    ]
    ended_by_ctrl_c(body, file)
