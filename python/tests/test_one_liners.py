"""Signed distances, insides, closest points and clearances of meshes, in one call each; what notebooks
show; messages in Python's terms."""

import base64
import re
import sys
import types
import zlib

import numpy as np
import pytest
import tesdf
from conftest import DATA, TETRAHEDRON

CUBE = DATA / "procedural" / "cube.obj"
APART = [0.05, 0, 0, 0, 0, 0, 1]


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """an empty folder for caches"""
    folder = tmp_path / "cache"
    monkeypatch.setenv("TESDF_CACHE", str(folder))
    return folder


def test_a_point_a_grid_and_rows(torus, asset, points):
    expected = asset.query(points)
    assert np.array_equal(tesdf.signed_distance(torus, points), expected.signed_distance)
    assert np.array_equal(tesdf.contains(torus, points), asset.is_inside(points))
    closest = tesdf.closest_point(torus, points)
    assert np.array_equal(closest.point, expected.closest_point) and np.array_equal(closest.face, expected.face)
    assert np.array_equal(closest.distance, np.abs(expected.signed_distance))
    grid = points[:600].reshape(20, 30, 3)
    assert np.array_equal(tesdf.signed_distance(torus, grid).ravel(), expected.signed_distance[:600])
    assert tesdf.closest_point(torus, grid).point.shape == (20, 30, 3)
    one = [1, 0, 0.1]
    assert isinstance(tesdf.signed_distance(torus, one), float) and tesdf.signed_distance(torus, one) < -0.2
    assert tesdf.contains(torus, one) and not tesdf.contains(torus, [0, 0, 0])
    point, face, distance = tesdf.closest_point(torus, one)
    assert point.shape == (3,) and face < 600 and distance == pytest.approx(np.linalg.norm(point - one))
    with pytest.raises(ValueError, match=r"points: an array of shape \(2,\); expected shape \(\.\.\., 3\)"):
        tesdf.signed_distance(torus, [1, 2])


def test_meshes_of_other_packages(tmp_path):
    vertices, faces = TETRAHEDRON
    pyvista = types.SimpleNamespace(points=vertices, triangulate=lambda: types.SimpleNamespace(points=vertices, regular_faces=faces))
    asset = tesdf.encode(TETRAHEDRON, "fast")
    asset.save(tmp_path / "part.tesdf")
    for mesh in (
        TETRAHEDRON,
        types.SimpleNamespace(vertices=vertices, faces=faces),
        types.SimpleNamespace(vertices=vertices, triangles=faces),  # Open3D
        types.SimpleNamespace(vertex=types.SimpleNamespace(positions=vertices), triangle=types.SimpleNamespace(indices=faces)),
        pyvista,
        tmp_path / "part.tesdf",
        asset,
    ):
        assert tesdf.signed_distance(mesh, [0.1, 0.3, 0.3]) == pytest.approx(-0.1, abs=1e-12)
    with pytest.raises(ValueError, match="mesh: int; expected a path, a pair"):
        tesdf.signed_distance(17, [0, 0, 0])


def test_a_mesh_is_encoded_once(cache, tmp_path):
    vertices, faces = TETRAHEDRON
    scaled = (vertices * 1.2345, faces)
    assert tesdf._native.asset_of(scaled) is tesdf._native.asset_of((vertices * 1.2345, faces.copy()))
    assert tesdf._native.asset_of(scaled) is not tesdf._native.asset_of(TETRAHEDRON)
    assert len(list(cache.iterdir())) == 1  # the tetrahedron is in the process
    path = tmp_path / "part.obj"
    path.write_text(CUBE.read_text())
    asset = tesdf._native.asset_of(path)
    assert asset.to_bytes() == tesdf.encode(path, "fast").to_bytes()
    # Scenes find it there.
    kept = sorted(cache.iterdir())
    body = {"name": "cube", "mesh": str(path), "mass": 1}
    tesdf.Simulation({"time_step": 1e-3, "duration": 1e-3, "bodies": [body]})
    assert sorted(cache.iterdir()) == kept and len(kept) == 2
    # The content counts, not the name.
    path.write_text(CUBE.read_text().replace("0.01", "0.02"))
    assert np.ptp(tesdf._native.asset_of(path).bounds, axis=0) == pytest.approx(2 * np.ptp(asset.bounds, axis=0))


def test_clearance_of_paths(torus):
    found = tesdf.clearance(CUBE, str(CUBE), None, APART)
    assert found.distance == pytest.approx(0.03, abs=1e-12)
    assert len(tesdf.collide(CUBE, tesdf.Plane())) > 0
    assert tesdf.clearance(torus, CUBE, pose_b=[0, 0, 0, 0, 0, 0, 1]).distance > 0.5


def test_numbers_that_are_not_real(asset):
    for wrong, kind in (([1j, 0, 0], "complex128"), ([True, False, True], "bool"), (["1", "2", "3"], "<U1")):
        with pytest.raises(ValueError, match=f"points: an array of {kind}; expected real numbers"):
            tesdf.signed_distance(asset, wrong)
        with pytest.raises(ValueError, match=f"points: an array of {kind}"):
            asset.query([wrong])
    with pytest.raises(ValueError, match="pose_b: an array of bool"):
        tesdf.clearance(asset, asset, pose_b=[True] * 7)


def test_messages_in_terms_of_python():
    vertices, faces = TETRAHEDRON
    with pytest.raises(TypeError, match=r"preset: ndarray; .* one argument: encode\(\(vertices, faces\)\)"):
        tesdf.encode(vertices, faces)
    with pytest.raises(tesdf.NotSolidError) as refused:
        tesdf.signed_distance((vertices, faces[:3]), [0, 0, 0])
    for text in ('`repair="auto"` makes it encodable', '`inside="sheet"` takes its faces', '`inside="generalized"`'):
        assert text in str(refused.value)
    with pytest.raises(tesdf.AssetError, match=r'encode it first: tesdf.encode\(mesh\).save\("FILE.tesdf"\)'):
        tesdf.Asset.open(CUBE)


def test_rows_of_contacts():
    contacts = tesdf.collide(CUBE, CUBE, pose_b=[0.018, 0.001, 0.002, 0, 0, 0, 1])
    first = contacts[0]
    assert first.distance == contacts.distance[0] and (first.point_a == contacts.point_a[0]).all()
    assert [c.distance for c in contacts] == contacts.distance.tolist() and len(contacts) > 2
    assert contacts[-1].face_b == contacts.face_b[-1]
    deep = contacts[contacts.distance < -1e-3]
    assert isinstance(deep, tesdf.Contacts) and 0 < len(deep) and (deep.distance < -1e-3).all()
    assert len(contacts[:2]) == 2 and len(contacts[[]]) == 0 and deep.statistics == contacts.statistics
    with pytest.raises(IndexError):
        contacts[len(contacts)]
    columns = contacts.to_dict()
    assert (columns["normal_y"] == contacts.normal[:, 1]).all()
    assert all(column.shape == (len(contacts),) for column in columns.values())
    table = contacts._repr_html_()
    assert table.count("<tr>") == 1 + min(len(contacts), 10) and "<th>point_a_x</th>" in table


def test_an_asset_in_a_notebook(asset):
    shown = asset._repr_html_()
    png = base64.b64decode(re.search(r"base64,([^\"]+)", shown)[1])
    width, height = (int.from_bytes(png[k : k + 4], "big") for k in (16, 20))
    length = int.from_bytes(png[33:37], "big")
    rows = np.frombuffer(zlib.decompress(png[41 : 41 + length]), np.uint8).reshape(height, 1 + 3 * width)[:, 1:]
    middle = rows.reshape(height, width, 3)[height // 2, width // 2].astype(int)
    assert middle[2] > middle[0]  # the hole of the torus is outside: blue
    assert "600 faces" in shown and len(shown) < 50_000


def test_threads_are_limited(torus):
    assert tesdf.encode(torus, "fast", threads=3).to_bytes() == tesdf.encode(torus, "fast").to_bytes()
    with pytest.raises(ValueError, match="threads: 1000000000; expected at most 1024"):
        tesdf.encode(torus, "fast", threads=10**9)


def test_integers_out_of_range_name_their_argument(asset):
    scene, worlds = tesdf.Scene(), tesdf.Worlds({"time_step": 1e-3, "duration": 1, "bodies": []}, 1)
    refused = [
        ("e_max", 0, lambda n: tesdf.encode(CUBE, e_max=n)),
        ("resolution", -1, lambda n: tesdf.encode(CUBE, resolution=n)),
        ("threads", 0, lambda n: tesdf.encode(CUBE, threads=n)),
        ("samples", -1, asset.verify),
        ("shape", -1, scene.remove_shape),
        ("b", 2**32, lambda n: scene.clearance(0, n)),
        ("iterations", -1, lambda n: scene.time_of_impact(0, 1, end=1.0, iterations=n)),
        ("part", -1, lambda n: scene.why(0, 1, n)),
        ("points", -1, lambda n: tesdf.PatchTracker(points=n)),
        ("count", -1, worlds.step),
        ("world", -1, worlds.contacts),
        ("every", 0, lambda n: tesdf.view("run.tesrun", "page.html", every=n)),
        ("contacts", -1, lambda n: tesdf.view("run.tesrun", "page.html", contacts=n)),
        ("reduce", -1, lambda n: scene.detect(reduce=n)),
    ]
    for name, least, call in refused:
        for value in (least, 2**70):
            with pytest.raises(ValueError, match=rf"^{name}: {value}; expected an integer (from|greater than) [01]"):
                call(value)
    with pytest.raises(TypeError, match="^samples: float; expected an integer from 0 to"):
        asset.verify(2.5)


def test_a_table_without_pandas_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ModuleNotFoundError, match="pip install pandas"):
        tesdf.collide(CUBE, CUBE, pose_b=[0.018, 0, 0, 0, 0, 0, 1]).to_dataframe()
