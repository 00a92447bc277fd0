"""The methods of trimesh's collision manager, against clearances of each pair."""

import itertools

import numpy as np
import pytest
import tesdf
from conftest import PARTS

CUBE, TORUS = PARTS / "cube.obj", PARTS / "torus_5k.obj"


def at(x, y=0.0, z=0.0):
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


@pytest.fixture
def manager():
    manager = tesdf.CollisionManager()
    for name, x in (("c", 0.03), ("a", 0.0), ("b", 0.019), ("far", 1.0)):
        manager.add_object(name, CUBE, at(x))
    return manager


def test_collisions(manager):
    assert manager.in_collision_internal() is True
    found, names, data = manager.in_collision_internal(return_names=True, return_data=True)
    assert found and names == {("a", "b"), ("b", "c")}
    assert {frozenset(contact.names) for contact in data} == {frozenset("ab"), frozenset("bc")}
    deepest = max(data, key=lambda contact: contact.depth)
    assert deepest.depth == pytest.approx(9e-3) and abs(deepest.normal[0]) == 1 and deepest.names == {"b", "c"}
    assert all(0 <= contact.index(name) < 12 for contact in data for name in contact.names)
    manager.set_transform("b", at(0.5))
    assert manager.in_collision_internal(return_names=True) == (False, set())
    assert manager.in_collision_single(CUBE, at(0.51), return_names=True) == (True, {"b"})
    assert not manager.in_collision_single(CUBE, at(0.7))
    # A solid that is inside of another one.
    assert manager.in_collision_single(tesdf.Sphere(1e-3), at(0.5), return_names=True) == (True, {"b"})
    assert manager.in_collision_single(tesdf.Plane(), at(0, 0, -0.05)) is False
    manager.remove_object("b")
    assert not manager.in_collision_single(CUBE, at(0.51)) and len(manager) == 3


def test_two_managers_with_the_same_names(manager):
    other = tesdf.CollisionManager()
    other.add_object("a", CUBE, at(0, 0.015))
    other.add_object("b", CUBE, at(0, 0.02))  # overlaps its own "a", which does not count
    found, names, data = manager.in_collision_other(other, return_names=True, return_data=True)
    assert found and names == {("a", "a"), ("b", "a"), ("a", "b"), ("b", "b")} and len(data) > 4
    other.set_transform("a", at(0, 0.1))
    other.set_transform("b", at(1, 0.025))
    assert manager.in_collision_other(other, return_names=True) == (False, set())
    distance, names = manager.min_distance_other(other, return_names=True)
    assert distance == pytest.approx(0.005) and names == ("far", "b")


def test_distances_are_the_least_of_all_pairs():
    random = np.random.default_rng(3)
    manager, bodies = tesdf.CollisionManager(), {}
    for k in range(30):
        pose = np.append(random.uniform(-0.3, 0.3, 3), random.normal(size=4))
        pose[3:] /= np.linalg.norm(pose[3:])
        round_shapes = tesdf.Sphere(0.01), tesdf.Capsule(0.02, 0.005), tesdf.Cylinder(0.02, 0.01)
        shape = [CUBE, tesdf.Box((0.01, 0.02, 0.03)), *round_shapes][k % 5]
        bodies[f"body {k}"] = shape, pose
        manager.add_object(f"body {k}", shape, pose)
    true = {
        (a, b): tesdf.clearance(bodies[a][0], bodies[b][0], bodies[a][1], bodies[b][1]).distance
        for a, b in itertools.combinations(bodies, 2)
    }
    distance, names, data = manager.min_distance_internal(return_names=True, return_data=True)
    assert distance == min(true.values()) and true[names] == distance == data.distance
    assert np.linalg.norm(data.point(names[0]) - data.point(names[1])) == pytest.approx(abs(distance))
    for name in ("body 0", "body 9"):
        assert manager.min_distance_internal(name) == min(d for pair, d in true.items() if name in pair)
    manager.add_object("floor", tesdf.Plane(), at(0, 0, -0.301))
    assert manager.min_distance_internal("floor") < 0.05
    distance, name = manager.min_distance_single(TORUS, at(0, 0, 50), return_name=True)
    assert distance > 40 and name in bodies


def test_replaced_and_missing_bodies(manager):
    manager.add_object("a", TORUS, at(5))
    assert len(manager) == 4 and not manager.in_collision_single(CUBE, at(-0.005))
    for call in (lambda: manager.remove_object("x"), lambda: manager.set_transform("x", at(0)), lambda: manager.min_distance_internal("x")):
        with pytest.raises(ValueError, match="x is not in the collision manager"):
            call()
    with pytest.raises(ValueError, match="no two bodies"):
        tesdf.CollisionManager().min_distance_internal()
    assert tesdf.CollisionManager().in_collision_internal() is False
