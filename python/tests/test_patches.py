"""Contact patches: all contacts in one of them, with ids that last."""

import dataclasses

import numpy as np
import pytest
import tesdf
from test_contacts import LINKED
from test_scene import balls


def two_feet():
    """two boxes on a plane"""
    scene = tesdf.Scene()
    floor, foot = scene.add_shape(tesdf.Plane()), scene.add_shape(tesdf.Box([1, 1, 1]))
    scene.add(floor)
    ids = scene.add_many(foot, [[0, 0, 0.99, 0, 0, 0, 1], [5, 0, 0.98, 0, 0, 0, 1]])
    return scene, ids


def test_patches_of_boxes_on_a_plane():
    scene, ids = two_feet()
    tracker = tesdf.PatchTracker()
    contacts = scene.detect()
    found = tracker.update(scene, contacts)
    assert len(found) == 2 and found.id.tolist() == [0, 1] and found.age.tolist() == [0, 0] and len(found.ended) == 0
    assert found.instance_a.tolist() == [0, 0] and found.instance_b.tolist() == ids.tolist()
    assert np.abs(found.area - 4).max() < 1e-6 and np.abs(found.distance - [-0.01, -0.02]).max() < 1e-12
    # From b, the box, to a, the plane.
    assert np.abs(found.normal - [0, 0, -1]).max() < 1e-9
    assert np.abs(found.center[:, :2] - [[0, 0], [5, 0]]).max() < 1e-6
    assert found.point_patch.tolist() == [0] * 4 + [1] * 4 and len(set(found.point_id.tolist())) == 4 * 2
    corners = {tuple(corner) for corner in np.round(contacts.point_a[found.point_contact[:4]][:, :2]).tolist()}
    assert corners == {(1, 1), (1, -1), (-1, 1), (-1, -1)}
    # The deepest contact comes first.
    assert contacts.distance[found.point_contact[0]] < contacts.distance[found.patch_of_contact == 0].min() + 1e-12


def test_every_contact_is_in_one_patch(asset):
    scene = tesdf.Scene()
    scene.add_many(scene.add_shape(asset), [[0, 0, 0, 0, 0, 0, 1], LINKED])
    contacts = scene.detect(mode="node", contact_distance=0.05)
    found = tesdf.PatchTracker(angle=np.radians(20), points=3).update(scene, contacts)
    assert len(found) > 1 and len(found.patch_of_contact) == len(contacts)
    assert set(found.patch_of_contact.tolist()) == set(range(len(found)))
    toward_a = np.where(contacts.instance_a == 0, 1, -1)[:, None] * contacts.normal
    for row in range(len(found)):
        members = np.flatnonzero(found.patch_of_contact == row)
        assert found.distance[row] == contacts.distance[members].min()
        deepest = toward_a[members[contacts.distance[members].argmin()]]
        assert np.degrees(np.arccos(np.clip(toward_a[members] @ deepest, -1, 1))).max() < 20 + 1e-6
        points = found.point_contact[found.point_patch == row]
        assert 1 <= len(points) <= 3 and set(points.tolist()) <= set(members.tolist())
    assert len(tesdf.PatchTracker(link=100.0).update(scene, contacts)) <= len(found)


def test_ids_last_while_the_bodies_touch():
    scene, ids = two_feet()
    tracker = tesdf.PatchTracker()
    first = tracker.update(scene, scene.detect())
    for step in range(1, 4):
        scene.update(ids, poses=[[0.1 * step, 0, 0.99, 0, 0, 0, 1], [5, 0, 0.98, 0, 0, 0, 1]])
        found = tracker.update(scene, scene.detect())
        assert found.id.tolist() == [0, 1] and found.age.tolist() == [step] * 2
        assert sorted(found.point_id) == sorted(first.point_id)  # corners that slide, and corners at rest
    scene.update(ids[:1], poses=[[0, 0, 9, 0, 0, 0, 1]])
    found = tracker.update(scene, scene.detect())
    assert found.id.tolist() == [1] and found.ended.tolist() == [0]
    scene.update(ids[:1], poses=[[0, 0, 0.99, 0, 0, 0, 1]])
    assert tracker.update(scene, scene.detect()).id.tolist() == [2, 1]
    empty, _ = balls([[0, 0, 0]])
    none = tracker.update(empty, empty.detect())
    assert len(none) == 0 and none.ended.tolist() == [1, 2] and none.normal.shape == (0, 3)


def test_contacts_of_a_simulation():
    body = {"name": "box", "shape": {"box": {"half_extents": [0.02, 0.02, 0.02]}}, "mass": 0.1, "translation": [0, 0, 0.02]}
    simulation = tesdf.Simulation({
        "time_step": 1e-3, "duration": 1, "bodies": [{"name": "floor", "shape": "plane", "fixed": True}, body],
    })
    scene = tesdf.Scene()
    scene.add(scene.add_shape(tesdf.Plane()))
    box = scene.add(scene.add_shape(tesdf.Box([0.02, 0.02, 0.02])))
    tracker = tesdf.PatchTracker()
    for age in range(3):
        scene.update([box], poses=simulation.poses[1:])
        simulation.step()
        found = tracker.update(scene, simulation.contacts)
        assert found.age.tolist() == [age] and found.area[0] == pytest.approx(0.04**2, rel=1e-6)


def test_what_is_refused():
    for options, text in (
        ({"angle": 2.0}, "angle is 2; expected 0 to"),
        ({"link": 0.0}, "link is 0; expected a finite number greater than 0"),
        ({"points": 0}, "points is 0; expected at least 1"),
    ):
        with pytest.raises(tesdf.CollideError, match=text):
            tesdf.PatchTracker(**options)
    scene, _ = two_feet()
    tracker, contacts = tesdf.PatchTracker(), scene.detect()
    with pytest.raises(ValueError, match="contacts: int; expected Contacts of Scene.detect"):
        tracker.update(scene, 3)
    with pytest.raises(ValueError, match="contacts: arrays of different lengths"):
        tracker.update(scene, dataclasses.replace(contacts, distance=contacts.distance[:-1]))
    with pytest.raises(tesdf.CollideError, match="instance 1 is not in the scene"):
        tracker.update(balls([[0, 0, 0]])[0], contacts)
    assert tracker.update(scene, contacts).id.tolist() == [0, 1]
