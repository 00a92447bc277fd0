"""Reports, and whether their classes have all fields of the library's reports."""

import numpy as np
import pytest
import tesdf
from conftest import DATA, TETRAHEDRON
from tesdf import reports

VERTICES, FACES = TETRAHEDRON


def test_a_good_mesh():
    report = tesdf.check(TETRAHEDRON)
    assert report.encodable and report.defects == () and report.winding == (0, 1)
    assert (report.vertices, report.faces, report.shells) == (4, 4, 1)
    assert report.min == (0, 0, 0) and report.max == (1, 1, 1) and report.diagonal == pytest.approx(3**0.5)
    assert str(report).endswith("ok: the inside is well defined")


def test_defects_have_places():
    report = tesdf.check((VERTICES, FACES[:3]))
    assert not report.encodable and report.winding is None
    defect = report.defects[0]
    assert isinstance(defect, reports.Defect) and (defect.kind, defect.severity) == ("open-edge", "error")
    assert set(defect.vertices) < {0, 2, 3} and len(defect.place) == 3 and str(defect) == defect.message
    (loop,) = report.boundary_loops
    assert loop.closed and sorted(loop.vertices) == [0, 2, 3] and loop.length == pytest.approx(2 + 2**0.5)


def test_notes_of_reading(tmp_path):
    path = tmp_path / "pyramid.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 .5 1\nf 4 3 2 1\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n")
    report = tesdf.check(path)
    assert report.encodable and report.faces == 6
    assert report.notes == tesdf.repair(path).report.notes


def test_repair():
    flipped = FACES.copy()
    flipped[2] = flipped[2][::-1]
    doubled = np.concatenate([flipped, [FACES[0]], [[1, 1, 2]]])
    vertices, faces, report = tesdf.repair((np.concatenate([VERTICES, [[9, 9, 9]]]), doubled))
    assert report.encodable and report.remaining == ()
    assert report.duplicate_faces == ((4, 0),) and report.collapsed_faces == (5,) and report.reversed_faces == (2,)
    assert report.unused_vertices == 1
    assert vertices.shape == (4, 3) and faces.shape == (4, 3) and faces.dtype == np.uint32
    assert tesdf.check((vertices, faces)).encodable
    assert "face reversed" in str(report) and str(report).endswith("ok: encodable")


def test_holes_are_filled():
    open_mesh = (VERTICES, FACES[:3])
    assert not tesdf.repair(open_mesh).report.encodable
    vertices, faces, report = tesdf.repair(open_mesh, fill_holes=True, orient=True)
    assert report.encodable and len(faces) == 4
    (hole,) = report.filled_holes
    assert isinstance(hole, reports.FilledHole) and hole.method == "flat" and hole.faces == 1
    assert len(hole.loops) == 1 and len(hole.loops[0]) == 3 and hole.area == pytest.approx(0.5)
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    (left,) = tesdf.repair((square, [[0, 1, 2], [0, 2, 3]]), fill_holes=3).report.holes_left
    assert left == reports.HoleLeft(vertices=left.vertices, reason="too-many-edges") and len(left.vertices) == 4
    for wrong in (2, "all", -1):
        with pytest.raises(ValueError, match="fill_holes: "):
            tesdf.repair(open_mesh, fill_holes=wrong)


def test_encoding_repairs_if_asked():
    with pytest.raises(tesdf.NotSolidError, match='`repair="auto"` makes it encodable'):
        tesdf.encode((VERTICES, FACES[:3]))
    asset = tesdf.encode((VERTICES, FACES[:3]), repair="auto")
    assert asset.source.repair == reports.Repair("--fill-holes", 0, 0, 0, 0, 1, pytest.approx(0.5))
    assert tesdf.encode(TETRAHEDRON, repair="auto").source.repair is None
    with pytest.raises(ValueError, match="repair: 'always'; expected 'auto' or None"):
        tesdf.encode(TETRAHEDRON, repair="always")


def test_the_weld_tolerance_is_found():
    corners = VERTICES[FACES].reshape(-1, 3) + np.random.default_rng(1).uniform(-1e-6, 1e-6, (12, 3))
    repaired = tesdf.repair((corners, np.arange(12).reshape(-1, 3)), weld_tolerance="auto")
    assert repaired.report.encodable and 1e-6 < repaired.report.weld_tolerance < 2e-5
    with pytest.raises(ValueError, match="weld_tolerance: 'some'"):
        tesdf.repair(TETRAHEDRON, weld_tolerance="some")


def test_weld_tolerance():
    corners = VERTICES[FACES].reshape(-1, 3) + np.random.default_rng(1).uniform(-1e-9, 1e-9, (12, 3))
    soup = (corners, np.arange(12).reshape(-1, 3))
    assert not tesdf.repair(soup).report.encodable
    welded = tesdf.repair(soup, weld_tolerance=1e-8)
    assert welded.report.encodable and len(welded.vertices) == 4 and len(welded.report.welded_vertices) == 8
    with pytest.raises(tesdf.MeshError, match="weld tolerance is -1"):
        tesdf.repair(soup, weld_tolerance=-1.0)


def test_t_junctions_are_reported():
    # Vertex 4 on the other side splits the edge 0-1 of one face.
    vertices = np.concatenate([VERTICES, [[0.5, 0, 0]]])
    faces = np.concatenate([FACES[1:], [[0, 2, 4], [4, 2, 1]]])
    (split,) = tesdf.repair((vertices, faces)).report.split_edges
    assert set(split.edge) == {0, 1} and split.at == (4,) and split.distance == 0


def test_a_mesh_out_of_range():
    report = tesdf.check((VERTICES * 1e308 * 1.5, FACES))
    assert not report.encodable and report.defects[0].kind == "out-of-range"
    assert np.isnan(report.diagonal)


def test_procedural_meshes_are_encodable():
    for path in sorted((DATA / "procedural").glob("*_c100.obj")):
        assert tesdf.check(path).encodable
