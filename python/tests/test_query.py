"""Answers against brute force over all faces, and the accepted forms of points."""

import multiprocessing
import threading

import numpy as np
import pytest
import tesdf
from make_reference import sdf  # numpy's brute force over all faces, in data/reference

# The promised errors for the torus's diagonal of 4.04, and the rounding of the brute force.
TOLERANCE = {"f64": 1e-11, "f32": 4.04e-6}


@pytest.fixture(scope="module")
def truth(torus, points):
    distances, winding = sdf(*torus, points)
    assert np.abs(winding - winding.round()).max() < 1e-6
    assert 100 < (distances < 0).sum() < len(points) - 100
    return distances


@pytest.mark.parametrize("precision", ["f64", "f32"])
def test_answers_equal_brute_force(asset, torus, points, truth, precision):
    distances, tolerance = truth, TOLERANCE[precision]
    answers = asset.query(points, precision)
    far = np.abs(distances) > tolerance
    assert np.abs(np.abs(answers.signed_distance) - np.abs(distances)).max() <= tolerance
    assert (np.sign(answers.signed_distance) == np.sign(distances))[far].all()
    # The closest point has that distance and lies on the named face. The gradient points away from
    # the closest point.
    offset = points - answers.closest_point
    assert np.abs(np.linalg.norm(offset, axis=1) - np.abs(distances)).max() <= tolerance
    vertices, faces = torus
    of_face = [abs(sdf(vertices, faces[[face]], [p])[0][0]) for p, face in zip(points, answers.face)]
    assert np.abs(of_face - np.abs(distances)).max() <= tolerance
    assert np.abs(np.linalg.norm(answers.gradient, axis=1) - 1).max() < 1e-6
    clear = np.abs(distances) > 1e-3
    assert np.abs(answers.gradient * distances[:, None] - offset)[clear].max() < 1e-3


def test_shapes_and_types(asset, points):
    answers = asset.query(points)
    n = len(points)
    assert [x.shape for x in answers] == [(n,), (n, 3), (n, 3), (n,)]
    assert [x.dtype for x in answers] == [np.float64, np.float64, np.float64, np.uint32]
    assert all(x.flags.c_contiguous and x.flags.writeable for x in answers)
    assert [x.shape for x in asset.query(np.empty((0, 3)))] == [(0,), (0, 3), (0, 3), (0,)]


def test_all_queries_agree(asset, points, truth):
    answers = asset.query(points)
    assert np.array_equal(asset.signed_distance(points), answers.signed_distance)
    one_by_one = [asset.query([p]) for p in points[:50]]
    assert np.array_equal(np.concatenate([a.closest_point for a in one_by_one]), answers.closest_point[:50])
    far = np.abs(truth) > 1e-11
    assert np.array_equal(asset.is_inside(points)[far], truth[far] < 0)
    in_domain = asset.query_in_domain(points)
    within = ~np.isnan(in_domain.signed_distance)
    assert 800 < within.sum() <= len(points) - 50
    assert (in_domain.face[~within] == tesdf.NO_FACE).all()
    for a, b in zip(in_domain, answers):
        assert np.array_equal(a[within], b[within])


def test_one_point(asset, points):
    for point in (points[0], points[0].tolist(), tuple(points[0])):
        for method in (asset.query, asset.query_in_domain):
            answers, row = method(point), method(points[:1])
            assert [x.shape for x in answers] == [(), (3,), (3,), ()] and isinstance(answers, type(row))
            assert all(np.array_equal(one, rows[0], equal_nan=True) for one, rows in zip(answers, row))
        assert asset.signed_distance(point) == tesdf.signed_distance(asset, point)
        assert isinstance(asset.signed_distance(point, "f32"), float)
        assert asset.is_inside(point) == tesdf.contains(asset, point) and asset.is_inside(point).shape == ()
    # Three rows are three points.
    assert asset.signed_distance(points[:3]).shape == (3,)


def test_points_of_any_layout(asset, points):
    expected = asset.query(points).signed_distance
    wide = np.zeros((len(points), 5))
    wide[:, 1:4] = points
    unaligned = np.frombuffer(b"\0" + points.tobytes(), np.uint8)[1:].view(np.float64).reshape(-1, 3)
    assert not unaligned.flags.aligned
    for same in (points.tolist(), np.asfortranarray(points), wide[:, 1:4], points[::-1][::-1], unaligned, points.astype(">f8")):
        assert np.array_equal(asset.query(same).signed_distance, expected)
    rounded = points.astype(np.float32)
    assert np.array_equal(asset.query(rounded).face, asset.query(rounded.astype(float)).face)
    frozen = points.copy()
    frozen.setflags(write=False)
    assert np.array_equal(asset.query(frozen).signed_distance, expected)


def test_more_points_than_a_chunk(asset, points):
    many = np.resize(points, ((1 << 19) + 7, 3))
    few, lots = asset.query(points, "f32"), asset.query(many, "f32")
    for a, b in zip(few, lots):
        assert np.array_equal(np.resize(a, b.shape), b)


def test_points_that_are_not_finite(asset):
    answers = asset.query([[np.nan, 0, 0], [0, np.inf, 0], [1, 0, 0]])
    assert np.isnan(answers.signed_distance).tolist() == [True, True, False]
    assert (answers.face == tesdf.NO_FACE).tolist() == [True, True, False]


@pytest.mark.parametrize("bad, text", [
    ([1.0, 2.0], r"points: an array of shape \(2,\); expected shape \(N, 3\) or \(3,\)"),
    (1.0, r"points: an array of shape \(\)"),
    (np.zeros((4, 2)), r"points: an array of shape \(4, 2\)"),
    (np.zeros((2, 4, 3)), r"points: an array of shape \(2, 4, 3\)"),
    ([["a", "b", "c"]], "points: an array of <U1; expected real numbers"),
])
def test_invalid_points_are_errors(asset, bad, text):
    with pytest.raises(ValueError, match=text):
        asset.query(bad)


def test_an_unknown_precision_is_an_error(asset):
    with pytest.raises(ValueError, match="precision: 'f16'; expected 'f64' or 'f32'"):
        asset.query([[0, 0, 0]], "f16")


def test_rays(asset):
    hits = asset.ray_cast([[-3, 0, 0.01], [0, 0, 3], [1, 0, 3], [0, 0, 0]], [[1, 0, 0], [0, 0, -1], [0, 0, -2], [0, 0, 0]])
    assert np.isfinite(hits.t).tolist() == [True, False, True, False]
    assert (hits.face == tesdf.NO_FACE).tolist() == [False, True, False, True]
    # The quadrangles (25 x 12) of the mesh lie inside of the torus by up to
    # 0.4 (1 - cos 15 degrees) and 1.4 (1 - cos 7.2 degrees).
    assert hits.t[0] == pytest.approx(1.6, abs=0.02)
    assert 2 * hits.t[2] == pytest.approx(2.6, abs=0.02)
    assert np.allclose(hits.point[2], [1, 0, 3 - 2 * hits.t[2]])
    assert hits.normal[0, 0] < -0.9 and hits.normal[2, 2] > 0.9
    assert np.abs(asset.signed_distance(hits.point[[0, 2]])).max() < 1e-12
    shared = asset.ray_cast([[-3, 0, 0.01], [-3, 0.1, 0]], [1, 0, 0], limit=1.0)
    assert np.isinf(shared.t).all() and np.isnan(shared.point).all()


def test_threads_share_an_asset(asset, points):
    expected = asset.query(points).signed_distance
    found = [None] * 4
    def ask(i):
        found[i] = asset.query(points).signed_distance
    threads = [threading.Thread(target=ask, args=(i,)) for i in range(4)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert all(np.array_equal(f, expected) for f in found)


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_assets_work_in_other_processes(asset, points, method):
    # A forked child has none of the threads that answered in the parent.
    expected = asset.query(points).signed_distance
    with multiprocessing.get_context(method).Pool(1) as pool:
        found = pool.apply_async(asset.signed_distance, (points,)).get(timeout=60)
    assert np.array_equal(found, expected)
