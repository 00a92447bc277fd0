"""Mesh arguments, options, progress and Ctrl-C."""

import os
import signal
import threading
import time
import types

import numpy as np
import pytest
import tesdf
from conftest import DATA, TETRAHEDRON
from ctrl_c import ended_by_ctrl_c

CUBE = DATA / "procedural" / "cube.obj"


def test_encode_a_file(tmp_path):
    asset = tesdf.encode(CUBE)
    assert asset.source.name == "cube.obj" and len(asset.source.blake3) == 64
    assert asset.to_bytes() == tesdf.encode(str(CUBE), "default").to_bytes()


def test_arrays_of_any_kind():
    vertices, faces = TETRAHEDRON
    expected = tesdf.encode(TETRAHEDRON).to_bytes()
    for mesh in (
        [vertices, faces],
        (vertices.tolist(), faces.tolist()),
        (vertices.astype(np.float32), faces.astype(np.uint8)),
        (np.asfortranarray(vertices), np.asfortranarray(faces)),
        types.SimpleNamespace(vertices=vertices, faces=faces),
        tesdf.repair(TETRAHEDRON),
    ):
        assert tesdf.encode(mesh).to_bytes() == expected
    # The point is 0.25 inside the side x = 0. test_query compares with brute force.
    assert tesdf.encode(TETRAHEDRON).signed_distance([[0.1, 0.3, 0.3]])[0] == pytest.approx(-0.1, abs=1e-12)


def test_options(torus):
    presets = ("default", "fast", "compact", "gpu")
    sizes = {preset: len(tesdf.encode(torus, preset).to_bytes()) for preset in presets}
    assert sizes["compact"] < sizes["default"] and sizes["gpu"] < sizes["default"]
    plain, wide = tesdf.encode(torus, "fast"), tesdf.encode(torus, "fast", band=1.0, regions=[[3, 3, 3, 3.5, 3.5, 3.5]])
    in_band, in_region = [[0, 0, 1.2]], [[3.2, 3.2, 3.2]]
    assert np.isnan(plain.query_in_domain(in_region).signed_distance[0])
    for point in (in_band, in_region):
        assert wide.query_in_domain(point).signed_distance[0] == plain.signed_distance(point)[0]
    assert plain.unit is None


def test_threads_change_nothing(torus):
    assert tesdf.encode(torus, threads=1).to_bytes() == tesdf.encode(torus, threads=3).to_bytes()


@pytest.mark.parametrize("mesh, error, text", [
    ((TETRAHEDRON[0], TETRAHEDRON[1] + 1), tesdf.MeshError, "face 1 uses vertex 4, but there are 4 vertices"),
    ((TETRAHEDRON[0], TETRAHEDRON[1] - 1), ValueError, "faces: face 0 uses vertex -1; expected ids from 0"),
    ((TETRAHEDRON[0], TETRAHEDRON[1].astype(float)), ValueError, "faces: an array of float64; expected integers"),
    ((TETRAHEDRON[0], np.zeros((3, 4), int)), ValueError, r"faces: an array of shape \(3, 4\); expected shape \(F, 3\)"),
    ((TETRAHEDRON[0][:, :2], TETRAHEDRON[1]), ValueError, r"vertices: an array of shape \(4, 2\)"),
    ((TETRAHEDRON[0] * np.nan, TETRAHEDRON[1]), tesdf.MeshError, "vertex 0 has the coordinate x = NaN"),
    ((TETRAHEDRON[0], np.zeros((0, 3), int)), tesdf.MeshError, "no faces"),
    (17, ValueError, "mesh: int; expected a path, a pair"),
    ("none.stl", FileNotFoundError, "cannot read none.stl"),
    (__file__, tesdf.MeshError, "test_encode.py: the extension names no mesh format"),
])
def test_invalid_meshes_are_errors(mesh, error, text):
    for function in (tesdf.encode, tesdf.check, tesdf.repair):
        with pytest.raises(error, match=text):
            function(mesh)


def test_meshes_without_an_inside_are_errors():
    vertices, faces = TETRAHEDRON
    with pytest.raises(tesdf.NotSolidError, match="no well-defined inside.*open edge") as caught:
        tesdf.encode((vertices, faces[:3]))
    report = caught.value.report
    assert not report.encodable and [d.kind for d in report.defects].count("open-edge") == 3
    assert report == tesdf.check((vertices, faces[:3]))


def test_invalid_options_are_errors(torus):
    with pytest.raises(tesdf.EncodeError, match="band"):
        tesdf.encode(torus, band=-1.0)
    with pytest.raises(ValueError, match="preset: 'best'; expected 'default', 'fast', 'compact', 'gpu', 'paper' or"):
        tesdf.encode(torus, "best")
    with pytest.raises(ValueError):
        tesdf.encode(torus, threads=0)


def test_progress(torus):
    seen = []
    tesdf.encode(torus, progress=lambda stage, share: seen.append((stage, share)))
    stages = ["refine", "tighten", "assemble"]
    assert seen[-1][0] == "assemble" and all(0 <= share <= 1 for _, share in seen)
    assert sorted(seen, key=lambda s: stages.index(s[0])) == seen


def test_an_exception_of_progress_ends_encode():
    seen = []

    def stop(stage, share):
        seen.append(share)
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        tesdf.encode(DATA / "procedural" / "iso_m16_bolt_24k.obj", progress=stop)
    assert len(seen) == 1 and seen[0] < 1


SAYING = [
    "said = []",
    "def progress(stage, share):",
    "    if not said: said.append(1); print('started', flush=True)",
]


def test_ctrl_c_ends_encode():
    body = [*SAYING, "tesdf.encode(sys.argv[1], progress=progress)"]
    ended_by_ctrl_c(body, DATA / "procedural" / "iso_m16_bolt_24k.obj")


def test_ctrl_c_ends_encode_at_once():
    # A torus of 328,050 faces. Its check takes seconds, and does not notice that it is cancelled.
    n = 405
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    u, v = np.meshgrid(angle, angle, indexing="ij")
    radius = 1 + 0.3 * np.cos(v)
    vertices = np.stack([radius * np.cos(u), radius * np.sin(u), 0.3 * np.sin(v)], -1).reshape(-1, 3)
    i, j = (index.ravel() for index in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    a, b, c, d = (k % n * n + m % n for k, m in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    sent = []

    def interrupt():
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.5, interrupt)
    try:
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            tesdf.encode((vertices, faces))
        assert time.monotonic() - sent[0] < 1
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)


def test_ctrl_c_ends_verify():
    # Checking 2^32 - 1 points would take days.
    body = ["asset = tesdf.encode(sys.argv[1])", "print('started', flush=True)", "asset.verify(2**32 - 1)"]
    ended_by_ctrl_c(body, CUBE)


def test_ctrl_c_ends_gmsh(tmp_path):
    gmsh = tmp_path / "gmsh"
    gmsh.write_text("#!/bin/sh\nexec sleep 300\n")
    gmsh.chmod(0o755)
    body = [*SAYING, "tesdf.encode(sys.argv[1], domain='gmsh', progress=progress)"]
    ended_by_ctrl_c(body, CUBE, environment={"TESDF_GMSH": str(gmsh)})


def test_inside():
    vertices, faces = TETRAHEDRON
    open_mesh = (vertices, faces[:-1])
    with pytest.raises(tesdf.NotSolidError, match='inside="generalized"'):
        tesdf.encode(open_mesh)
    asset = tesdf.encode(open_mesh, "fast", inside="generalized")
    assert asset.certificate.inside["rule"] == "generalized" and asset.certificate.jumps
    assert asset.is_inside([[0.25, 0.25, 0.25], [2, 2, 2]]).tolist() == [True, False]
    sheet = tesdf.encode(open_mesh, "fast", inside="sheet", thickness=0.25)
    assert sheet.signed_distance([vertices[0]])[0] == pytest.approx(-0.125, abs=1e-12)
    turned = (vertices, faces[:, ::-1])
    assert tesdf.encode(turned, inside="nonzero").is_inside([[0.1, 0.1, 0.1]])[0]
    assert tesdf.encode(TETRAHEDRON).certificate.inside is None
    for options, says in (
        ({"inside": "sheet"}, "needs its thickness"),
        ({"thickness": 1.0}, "only the faces of a sheet"),
        ({"inside": "outside"}, "expected 'winding'"),
        ({"surface": "some"}, "expected 'all' or 'boundary'"),
    ):
        with pytest.raises(ValueError if "expected" in says else tesdf.EncodeError, match=says):
            tesdf.encode(TETRAHEDRON, **options)
