"""Many pairs in one call, and kept pairs: the same as one pair at a time, and as a fresh detection."""

import numpy as np
import pytest
import tesdf
from ctrl_c import ended_by_ctrl_c
from test_scene import balls, random_poses


def test_clearances_are_those_of_each_pair(asset):
    scene = tesdf.Scene()
    poses = [2, 2, 2, 1, 1, 1, 1] * random_poses(6)
    scene.add_many(scene.add_shape(asset), poses)
    scene.add(scene.add_shape(tesdf.Plane()), [0, 0, -3, 0, 0, 0, 1])
    pairs = np.array([(a, b) for a in range(7) for b in range(7) if a != b])
    found = scene.clearances(pairs, tolerance=1e-6)
    assert len(found) == 42 and (found.distance < 0).any() and (found.distance > 0).any()
    assert np.array_equal(np.stack([found.instance_a, found.instance_b], 1), pairs)
    for row, (a, b) in enumerate(pairs.tolist()):
        alone = vars(scene.clearance(a, b, tolerance=1e-6))
        assert {name: np.asarray(getattr(found, name)[row]).tolist() for name in alone} == {
            name: list(value) if isinstance(value, tuple) else value for name, value in alone.items()
        }
    assert len(scene.clearances(np.zeros((0, 2), int))) == 0


def test_times_of_impact_are_those_of_each_pair(asset):
    scene = tesdf.Scene()
    scene.add_many(scene.add_shape(asset), [[5.0 * k, 0, 0, 0, 0, 0, 1] for k in range(4)])
    pairs = [[0, 1], [1, 2], [2, 3], [3, 0]]
    velocities = np.array([[3, 0, 0, 0, 0, 1], [0.1, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0], [-9, 0, 0.2, 1, 2, 3.0]])
    found = scene.times_of_impact(pairs, velocities_a=velocities, end=2)
    assert found.touches.tolist() == [True, False, False, True]
    for row, (a, b) in enumerate(pairs):
        alone = scene.time_of_impact(a, b, velocity_a=velocities[row], end=2)
        if alone is None:
            assert found.time[row] == np.inf and np.isnan(found.distance[row]) and found.face_a[row] == tesdf.NO_FACE
        else:
            assert (found.time[row], found.distance[row], tuple(found.point_b[row])) == (alone.time, alone.distance, alone.point_b)
            assert (found.iterations[row], found.touches[row]) == (alone.iterations, alone.touches)
            assert (found.free_until[row], found.decided[row]) == (alone.time, True)
    screws = np.tile([0, 0, 0, 1, 0, 0, 2 * np.pi, 3.0], (4, 1))
    found = scene.times_of_impact(pairs, screws_b=-screws, velocities_a=np.zeros((4, 6)))
    alone = scene.time_of_impact(0, 1, screw_b=-screws[0])
    assert (found.time[0] if alone else np.inf) == (alone.time if alone else found.time[0])


def test_rows_that_are_refused(asset):
    scene, _ = balls([[0, 0, 0], [3, 0, 0]])
    for call, error, text in (
        (lambda: scene.clearances([[0, 1], [1, 1]]), tesdf.CollideError, "pairs: row 1: .*one and the same"),
        (lambda: scene.clearances([[0, 1], [1, 0], [0, 7], [8, 0]]), tesdf.CollideError, "pairs: row 2: instance 7 is not in the scene"),
        (lambda: scene.clearances([0, 1]), ValueError, r"pairs: .*\(2,\); expected shape \(P, 2\)"),
        (lambda: scene.times_of_impact([[0, 1]], velocities_a=np.zeros(6)), ValueError, r"velocities_a: .*; expected shape \(1, 6\)"),
        (lambda: scene.times_of_impact([[0, 1]], screws_b=np.zeros((2, 8))), ValueError, r"screws_b: .*; expected shape \(1, 8\)"),
        (lambda: scene.times_of_impact([[0, 1]], velocities_a=[[0] * 6], screws_a=[[0] * 8]), ValueError, "velocities_a: given together with screws_a"),
        (lambda: scene.times_of_impact([[0, 1]], screws_a=[[0] * 8]), tesdf.CollideError, "pairs: row 0: .*screw axis"),
    ):
        with pytest.raises(error, match=text):
            call()


def test_ctrl_c_ends_many_clearances(asset, tmp_path):
    asset.save(tmp_path / "torus.tesdf")
    body = [
        "import numpy as np",
        "scene, asset = tesdf.Scene(), tesdf.Asset.open(sys.argv[1])",
        "poses = [[1e-3 * k, 0, 0, 0, 0, 0, 1] for k in range(300)]",
        "scene.add_many(scene.add_shape(asset), poses)",
        "pairs = np.stack(np.triu_indices(300, 1), 1)",
        "print('started', flush=True)",
        "scene.clearances(pairs)",
    ]
    ended_by_ctrl_c(body, tmp_path / "torus.tesdf")


def test_kept_pairs_give_the_contacts_of_a_detection(asset):
    random, scene = np.random.default_rng(4), tesdf.Scene()
    poses = [9, 9, 1, 1, 1, 1, 1] * random_poses(60)
    ids = scene.add_many(scene.add_shape(asset), poses, scale=0.5)
    scene.add(scene.add_shape(tesdf.Plane()), [0, 0, -1, 0, 0, 0, 1])
    kept = tesdf.InstancePairs()
    assert len(kept.pairs) == 0
    met = set()
    for step in range(12):
        moved = ids[random.random(60) < 0.3]
        poses[moved, :3] += random.normal(scale=0.1 if step % 4 else 3, size=(len(moved), 3))
        scene.update(moved, poses=poses[moved])
        options = {"mode": "node", "contact_distance": 0.01 * (1 + step // 6)}
        expected = scene.detect(**options)
        found = kept.detect(scene, moved=moved if step % 2 else None, **options)
        assert len(found) == len(expected)
        assert all(np.array_equal(array, getattr(expected, name)) for name, array in found.arrays().items())
        assert found.statistics == expected.statistics
        touching = set(zip(found.instance_a.tolist(), found.instance_b.tolist()))
        assert {tuple(sorted(pair)) for pair in touching} <= {tuple(pair) for pair in kept.pairs.tolist()}
        met.add(len(touching))
    assert len(met) > 3 and (kept.pairs[:, 0] < kept.pairs[:, 1]).all() and repr(kept) == f"<tesdf.InstancePairs: {len(kept.pairs)} pairs>"


def test_pairs_of_instances_that_are_not_there():
    scene, _ = balls([[0, 0, 0], [1, 0, 0]])
    kept = tesdf.InstancePairs()
    assert len(kept.detect(scene)) == 2
    with pytest.raises(tesdf.CollideError, match="instance 5 is not in the scene"):
        kept.detect(scene, moved=[5])
    with pytest.raises(tesdf.CollideError, match="contact_distance is -1e0"):
        kept.detect(scene, contact_distance=-1.0)
    # Another scene, and an instance less.
    other, ids = balls([[0, 0, 0], [1, 0, 0], [2.5, 0, 0]])
    assert len(kept.detect(other)) == len(other.detect()) == 4
    other.remove(ids[1:2])
    assert len(kept.detect(other)) == 0


def test_memory_by_dlpack_alone(asset, points):
    class OnlyDlpack:
        def __init__(self, array):
            self.array = array

        def __dlpack__(self, **asked):
            return self.array.__dlpack__(**asked)

        def __dlpack_device__(self):
            return self.array.__dlpack_device__()

    answers = asset.query(OnlyDlpack(points))
    assert all(np.array_equal(a, b) for a, b in zip(answers, asset.query(points)))
    # Results are arrays, which other libraries take without a copy.
    shared = np.from_dlpack(answers.gradient)
    assert np.shares_memory(shared, answers.gradient)
    scene = tesdf.Scene()
    ids = scene.add_many(scene.add_shape(asset), OnlyDlpack(random_poses(3)))
    scene.update(OnlyDlpack(ids), poses=OnlyDlpack(random_poses(3, seed=2)))
    assert np.abs(scene.instances.poses - random_poses(3, seed=2)).max() < 1e-15
