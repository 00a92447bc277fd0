"""Bodies from memory: assets, meshes and shapes as objects, and poses, wherever bodies are named."""

import numpy as np
import pytest
import tesdf
from conftest import PARTS


class Mesh:
    """What trimesh.Trimesh and others have."""

    def __init__(self, vertices, faces):
        self.vertices, self.faces = vertices, faces


@pytest.fixture(scope="module")
def cube():
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float) * 0.03
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return corners, np.array([[a, *pair] for a, b, c, d in sides for pair in ((b, c), (c, d))])


def scene(body, floor=None):
    return {
        "time_step": 5e-3,
        "duration": 0.1,
        "bodies": [
            {"name": "floor", "shape": "plane" if floor is None else floor, "fixed": True},
            {"name": "body", "density": 1000, "friction": 0.5, **body},
        ],
    }


def ends(body, floor=None):
    simulation = tesdf.Simulation(scene(body, floor))
    simulation.run()
    return simulation.poses.tobytes()


def test_geometries_of_a_simulation_come_from_memory(cube, tmp_path):
    place = {"translation": [0, 0, 0.031]}
    path = tmp_path / "cube.obj"
    lines = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in cube[0].tolist()]
    path.write_text("".join(lines + [f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in cube[1].tolist()]))
    expected = ends({"mesh": path, **place})
    asset = tesdf.encode(cube, "fast")
    assert ends({"asset": asset, **place}) == expected
    assert ends({"shape": asset, **place}, tesdf.Plane()) == expected
    assert ends({"mesh": cube, **place}) == expected
    assert ends({"mesh": Mesh(*cube), **place}) == expected
    for shape, keys in [
        (tesdf.Box((0.03, 0.03, 0.02)), {"box": {"half_extents": [0.03, 0.03, 0.02]}}),
        (tesdf.Sphere(0.025), {"sphere": {"radius": 0.025}}),
        (tesdf.Capsule(0.01, 0.03), {"capsule": {"half_height": 0.01, "radius": 0.03}}),
        (tesdf.Cylinder(0.01, 0.03), {"cylinder": {"half_height": 0.01, "radius": 0.03}}),
    ]:
        assert ends({"shape": shape, **place}) == ends({"shape": keys, **place}) != expected


def test_bodies_share_what_is_one_object_and_rules_of_inside_hold(cube):
    sheet = {"mesh": Mesh(*cube), "inside": "sheet", "thickness": 1e-3, "translation": [0, 0, 0.04]}
    hollow, solid = tesdf.Simulation(scene(sheet)), tesdf.Simulation(scene({**sheet, "inside": "winding", "thickness": None}))
    assert hollow.masses[1] == pytest.approx(1000 * 6 * 0.06**2 * 1e-3, rel=1e-9)
    assert solid.masses[1] == pytest.approx(1000 * 0.06**3, rel=1e-9)
    both = scene(sheet)
    both["bodies"].append({**both["bodies"][1], "name": "other", "translation": [1, 0, 0.04]})
    worlds = tesdf.Worlds(both, 2)
    worlds.step(3)
    assert np.array_equal(worlds.masses[:, 1], worlds.masses[:, 2])
    # What the caller gave is as it was.
    assert both["bodies"][1]["inside"] == "sheet" and isinstance(both["bodies"][1]["mesh"], Mesh)


def test_a_run_from_memory_is_saved_and_seen(cube, tmp_path):
    simulation = tesdf.Simulation(scene({"mesh": cube, "translation": [0, 0, 0.031]}))
    simulation.run()
    tesdf.view(simulation, tmp_path / "run.html", contacts=0)
    simulation.save(tmp_path / "run.tesrun")
    with pytest.raises(tesdf.SceneError, match="(?s)body body: .*<memory>/0.tesdf"):
        tesdf.view(tmp_path / "run.tesrun", tmp_path / "page.html")
    tesdf.encode(cube, "fast").save(tmp_path / "cube.tesdf")
    tesdf.view(tmp_path / "run.tesrun", tmp_path / "page.html", contacts=0, geometries={"body": tmp_path / "cube.tesdf"})


def test_poses_are_those_of_a_scene(cube):
    half = np.sqrt(0.5)
    pose = np.array([0.1, 0.2, 0.3, 0, 0, half, half])
    matrix = [[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]]
    box = {"shape": tesdf.Box((0.01, 0.02, 0.03))}
    apart = {"translation": pose[:3], "rotation": pose[3:]}
    first = tesdf.Simulation(scene({**box, **apart, "velocity": [1, 2, 3], "angular_velocity": [4, 5, 6]}))
    one = tesdf.Simulation(scene({**box, "pose": pose, "velocity": np.arange(1, 7)}))
    assert one.poses.tobytes() == first.poses.tobytes() and one.velocities.tobytes() == first.velocities.tobytes()
    assert tesdf.Simulation(scene({**box, "pose": matrix})).poses[1] == pytest.approx(pose, abs=1e-15)
    placed = tesdf.Scene()
    placed.add(placed.add_shape(tesdf.Sphere(1)), pose)
    assert np.array_equal(placed.instances.poses[0], first.poses[1])
    row = tesdf.Simulation(scene({**box, "pose": pose, "copies": {"count": 3, "pose": [0.1, 0, 0, 0, 0, 0, 1]}}))
    assert row.poses[1:, 1] == pytest.approx([0.2, 0.3, 0.4])


def test_meshes_are_shapes_of_scenes(cube):
    asset = tesdf.encode(cube, "fast")
    expected = tesdf.collide(asset, tesdf.Plane(), pose_a=[0, 0, 0.02, 0, 0, 0, 1]).distance
    assert len(expected) > 0
    for mesh in (cube, Mesh(*cube)):
        found = tesdf.collide(mesh, tesdf.Plane(), pose_a=[0, 0, 0.02, 0, 0, 0, 1]).distance
        assert found.tobytes() == expected.tobytes()
        placed = tesdf.Scene()
        assert placed.add_shape(mesh) == 0 and isinstance(placed.shapes[0], tesdf.Asset)
    assert tesdf.clearance(cube, cube, pose_b=[0.1, 0, 0, 0, 0, 0, 1]).distance == pytest.approx(0.04)


def test_what_is_no_body_is_refused(cube):
    with pytest.raises(ValueError, match="bodies: entry 1: pose beside translation; expected one of them"):
        tesdf.Simulation(scene({"mesh": cube, "pose": [0, 0, 0, 0, 0, 0, 1], "translation": [0, 0, 1]}))
    with pytest.raises(ValueError, match=r"bodies: entry 1: a pose of 6 numbers and 0 rows; expected 7 numbers"):
        tesdf.Simulation(scene({"mesh": cube, "pose": np.zeros(6)}))
    with pytest.raises(ValueError, match="bodies: entry 1: velocity: six numbers beside angular_velocity"):
        tesdf.Simulation(scene({"mesh": cube, "velocity": np.zeros(6), "angular_velocity": [0, 0, 1]}))
    with pytest.raises(ValueError, match="mesh: int; expected a path, a pair"):
        tesdf.Simulation(scene({"mesh": 3}))
    with pytest.raises(tesdf.NotSolidError):
        tesdf.Simulation(scene({"mesh": (cube[0], cube[1][:-1])}))
    with pytest.raises(tesdf.SceneError, match="more than one of asset, mesh, shape and parts"):
        tesdf.Simulation(scene({"mesh": cube, "shape": {"sphere": {"radius": 1.0}}}))
    with pytest.raises(ValueError, match="shape: int; expected an Asset, Plane, Box, Sphere, Capsule or Cylinder, or a mesh"):
        tesdf.Scene().add_shape(3)
