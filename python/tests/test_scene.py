"""Scenes: shapes, instances, their poses in bulk, and which pairs meet."""

import copy

import numpy as np
import pytest
import tesdf

IDENTITY = [0, 0, 0, 0, 0, 0, 1]


def random_poses(n, seed=1):
    random = np.random.default_rng(seed)
    rotations = random.normal(size=(n, 4))
    return np.hstack([random.uniform(-1, 1, (n, 3)), rotations / np.linalg.norm(rotations, axis=1)[:, None]])


def matrices(poses):
    x, y, z, w = poses[:, 3:].T
    found = np.zeros((len(poses), 4, 4))
    found[:, 0, :3] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], 1)
    found[:, 1, :3] = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], 1)
    found[:, 2, :3] = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], 1)
    found[:, :3, 3], found[:, 3, 3] = poses[:, :3], 1
    return found


def balls(places, **states):
    """a scene of unit spheres"""
    scene = tesdf.Scene()
    poses = np.hstack([np.asarray(places, float), np.tile([0, 0, 0, 1.0], (len(places), 1))])
    return scene, scene.add_many(scene.add_shape(tesdf.Sphere(1.0)), poses, **states)


def pairs(contacts):
    return sorted(set(zip(contacts.instance_a.tolist(), contacts.instance_b.tolist())))


ROW = [[0, 0, 0], [1.5, 0, 0], [3, 0, 0]]


def test_shapes_come_back(asset):
    scene = tesdf.Scene()
    shapes = [asset, tesdf.Plane(), tesdf.Box((1, 2, 3)), tesdf.Sphere(0.5), tesdf.Capsule(half_height=2, radius=1)]
    shapes.append(tesdf.Cylinder(half_height=3, radius=1))
    assert [scene.add_shape(shape) for shape in shapes] == [0, 1, 2, 3, 4, 5]
    assert [scene.shapes[k] for k in range(1, 6)] == shapes[1:]
    assert scene.shapes[0].to_bytes() == asset.to_bytes()
    scene.remove_shape(2)
    assert list(scene.shapes) == [0, 1, 3, 4, 5] and scene.add_shape(tesdf.Plane()) == 6
    assert repr(scene) == "<tesdf.Scene: 0 instances of 6 shapes>" and len(scene) == 0


def test_states_come_back():
    scene, poses = tesdf.Scene(), random_poses(5)
    ball, box = scene.add_shape(tesdf.Sphere(1)), scene.add_shape(tesdf.Box([1, 1, 1]))
    velocities = np.arange(30.0).reshape(5, 6)
    ids = scene.add_many([ball, box] * 2 + [ball], poses, velocities=velocities, scale=[1, 2, 3, 4, 5], world=7, filter=3)
    assert ids.dtype == np.uint32 and ids.tolist() == [0, 1, 2, 3, 4]
    found = scene.instances
    assert len(found) == len(scene) == 5 and found.shape.tolist() == [ball, box, ball, box, ball]
    assert np.abs(found.poses - poses).max() < 1e-15 and np.array_equal(found.velocities, velocities)
    assert found.scale.tolist() == [1, 2, 3, 4, 5] and found.world.tolist() == [7] * 5
    assert found.memberships.tolist() == [0xFFFFFFFF] * 5 and found.filter.tolist() == [3] * 5
    # A quaternion of exactly unit length is kept bit for bit.
    assert scene.add(ball, [1, 2, 3, 0.6, 0, 0, 0.8], velocity=[0, 0, 1, 0, 0, 0], scale=0.1) == 5
    last = scene.instances
    assert last.poses[5].tolist() == [1, 2, 3, 0.6, 0, 0, 0.8] and last.scale[5] == 0.1
    scene.add(ball)
    assert scene.instances.poses[6].tolist() == IDENTITY


def test_updates_change_what_is_given():
    scene, ids = balls(ROW)
    before = scene.instances
    poses = random_poses(2)
    scene.update(ids[[2, 0]], poses=poses, world=[1, 2])
    after = scene.instances
    assert np.abs(after.poses[[2, 0]] - poses).max() < 1e-15 and after.world.tolist() == [2, 0, 1]
    assert np.array_equal(after.poses[1], before.poses[1]) and np.array_equal(after.scale, before.scale)
    assert np.abs(before.poses[:, 0] - [0, 1.5, 3]).max() == 0
    scene.update(ids, velocities=np.ones((3, 6)), scale=2, memberships=[1, 2, 4], filter=0)
    found = scene.instances
    assert (found.velocities == 1).all() and (found.scale == 2).all() and found.memberships.tolist() == [1, 2, 4]
    scene.remove(ids[[1]])
    assert scene.instances.ids.tolist() == [0, 2] and scene.add(0) == 3
    scene.update([], poses=np.empty((0, 7)))


def test_matrices_are_poses():
    poses = random_poses(50)
    by_numbers, by_matrix = tesdf.Scene(), tesdf.Scene()
    for scene, given in ((by_numbers, poses), (by_matrix, matrices(poses))):
        scene.add_many(scene.add_shape(tesdf.Box([0.3, 0.2, 0.1])), given)
    a, b = by_numbers.instances.poses, by_matrix.instances.poses
    turned = np.sign((a[:, 3:] * b[:, 3:]).sum(1))  # q and -q are one rotation
    assert np.array_equal(a[:, :3], b[:, :3]) and np.abs(a[:, 3:] - turned[:, None] * b[:, 3:]).max() < 1e-14
    # Rounding can change which of several contacts of flat faces are found, but not the deepest one.
    a, b = (scene.detect(reduce=1, tolerance=1e-9) for scene in (by_numbers, by_matrix))
    a, b = (dict(zip(map(tuple, map(sorted, zip(c.instance_a, c.instance_b))), c.distance)) for c in (a, b))
    assert len(a) > 50 and a == pytest.approx(b, abs=1e-8)
    # Single precision is near enough.
    by_matrix.update(range(50), poses=matrices(poses).astype(np.float32))
    turn = by_matrix.add(0, np.array([[0, -1, 0, 4], [1, 0, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]))
    assert np.allclose(by_matrix.instances.poses[turn], [4, 5, 6, 0, 0, 0.5**0.5, 0.5**0.5])


def test_which_pairs_meet():
    assert pairs(balls(ROW)[0].detect()) == [(0, 1), (1, 0), (1, 2), (2, 1)]
    assert pairs(balls(ROW, world=[0, 0, 1])[0].detect()) == [(0, 1), (1, 0)]
    assert pairs(balls(ROW, memberships=[1, 2, 4], filter=[4, 4, 3])[0].detect()) == [(1, 2), (2, 1)]
    scene, _ = balls(ROW)
    scene.exclude([[1, 0], [2, 1]])
    assert scene.excluded.tolist() == [[0, 1], [1, 2]] and len(scene.detect()) == 0
    scene.include([[0, 1]])
    assert pairs(scene.detect()) == [(0, 1), (1, 0)]
    scene.include(scene.excluded)
    assert scene.excluded.shape == (0, 2) and scene.excluded.dtype == np.uint32


def test_copies_are_separate():
    scene, ids = balls(ROW)
    other = copy.copy(scene)
    other.update(ids, poses=np.tile(IDENTITY, (3, 1)))
    assert len(scene) == len(other) and scene.instances.poses[2, 0] == 3 and other.instances.poses[2, 0] == 0


@pytest.mark.parametrize("poses, error, text", [
    (np.zeros((2, 6)), ValueError, r"poses: an array of shape \(2, 6\); expected shape \(N, 7\), each x y z qx qy qz qw, or \(N, 4, 4\)"),
    (IDENTITY, ValueError, r"poses: an array of shape \(7,\)"),
    ([IDENTITY, [0] * 7], tesdf.CollideError, "poses: row 1: not a pose: quaternion .* of length 0; expected length 1"),
    ([IDENTITY] * 3 + [[0, np.nan, 0, 0, 0, 0, 1]], tesdf.CollideError, "poses: row 3: not a pose: .*; expected finite numbers"),
    ([[np.inf, 0, 0, 0, 0, 0, 1]], tesdf.CollideError, "poses: row 0: .*; expected finite numbers"),
    ([[1e60, 0, 0, 0, 0, 0, 1]], tesdf.CollideError, "instance 0: translation 1e60 is too far out"),
    ([np.eye(4), 2 * np.eye(4)], tesdf.CollideError, r"poses: row 1: not a pose: last row \[0.0, 0.0, 0.0, 2.0\]"),
    ([np.diag([2, 2, 2, 1])], tesdf.CollideError, "poses: row 0: not a pose: a matrix that deforms or mirrors"),
    ([np.diag([1, 1, -1, 1])], tesdf.CollideError, "poses: row 0: not a pose: a matrix that deforms or mirrors"),
    ([np.diag([np.nan, 1, 1, 1])], tesdf.CollideError, "poses: row 0: not a pose: matrix .*; expected finite numbers"),
    ([["a"] * 7], ValueError, "poses: an array of <U1; expected real numbers"),
])
def test_invalid_poses_are_errors(poses, error, text):
    scene = tesdf.Scene()
    ball = scene.add_shape(tesdf.Sphere(1))
    with pytest.raises(error, match=text):
        scene.add_many(ball, poses)
    assert len(scene) == 0


@pytest.mark.parametrize("call, error, text", [
    (lambda s: s.add(9), tesdf.CollideError, "shape 9 is not in the scene"),
    (lambda s: s.add(0, np.zeros((1, 7))), ValueError, r"pose: an array of shape \(1, 7\); expected shape \(7,\)"),
    (lambda s: s.add(0, [0] * 7), tesdf.CollideError, "pose: not a pose: quaternion"),
    (lambda s: s.add(0, scale=0), tesdf.CollideError, "scale 0; expected a finite number greater than 0"),
    (lambda s: s.add(0, velocity=[0, 0, np.nan, 0, 0, 0]), tesdf.CollideError, "velocity .*NaN"),
    (lambda s: s.add(0, world=-1), ValueError, "world: -1; expected integers from 0"),
    (lambda s: s.add(0, world=1.5), ValueError, "world: an array of float64; expected integers"),
    (lambda s: s.add(0, [0] * 7, [0] * 6), TypeError, "positional"),
    (lambda s: s.add_many([0, 1], [IDENTITY] * 3), ValueError, r"shape: .*\(2,\); expected an integer, or shape \(3,\)"),
    (lambda s: s.add_many(0, [IDENTITY] * 2, scale=[1] * 3), ValueError, r"scale: .*\(3,\); expected a number, or shape \(2,\)"),
    (lambda s: s.add_many(0, [IDENTITY] * 2, velocities=np.zeros((3, 6))), ValueError, "velocities: 3 rows; expected 2"),
    (lambda s: s.add_many(0, [IDENTITY] * 2, scale=[1, np.nan]), tesdf.CollideError, "instance 1: scale NaN"),
    (lambda s: s.update([0, 8]), tesdf.CollideError, "instance 8 is not in the scene"),
    (lambda s: s.update([0], poses=[IDENTITY] * 2), ValueError, "poses: 2 rows; expected 1"),
    (lambda s: s.update([0, 1], poses=[IDENTITY, [0] * 7]), tesdf.CollideError, "poses: row 1"),
    (lambda s: s.update([0, 1], scale=[2, -1]), tesdf.CollideError, "instance 1: scale -1"),
    (lambda s: s.update(0), ValueError, r"ids: an array of shape \(\)"),
    (lambda s: s.remove([0, 5]), tesdf.CollideError, "instance 5 is not in the scene"),
    (lambda s: s.remove_shape(0), tesdf.CollideError, "shape 0 is used by instance 0"),
    (lambda s: s.exclude([[0, 1], [0, 7]]), tesdf.CollideError, "instance 7"),
    (lambda s: s.exclude([0, 1]), ValueError, r"pairs: an array of shape \(2,\); expected shape \(P, 2\)"),
    (lambda s: s.add_shape(17), ValueError, "shape: int; expected an Asset, Plane, Box, Sphere, Capsule or Cylinder, or a mesh: "),
    (lambda s: s.add_shape(tesdf.Sphere(-1)), tesdf.CollideError, "sphere: radius -1; expected"),
    (lambda s: s.add_shape(tesdf.Sphere(None)), ValueError, "shape.radius: NoneType; expected a number"),
    (lambda s: s.add_shape(tesdf.Box([1, 2])), ValueError, "shape.half_extents: list; expected three numbers"),
])
def test_invalid_calls_are_errors_and_change_nothing(call, error, text):
    scene, _ = balls(ROW)
    before = scene.instances
    with pytest.raises(error, match=text):
        call(scene)
    after = scene.instances
    assert all(np.array_equal(getattr(before, name), getattr(after, name)) for name in vars(before))
    assert len(scene.shapes) == 1 and len(scene.excluded) == 0
