"""Encoders and domains: what they prove and refuse, and moving vertices."""

import pickle

import numpy as np
import pytest
import tesdf
from conftest import DATA, TETRAHEDRON
from make_reference import sdf

CUBE = DATA / "procedural" / "cube.obj"


@pytest.fixture(scope="module")
def deformable(beam):
    mesh, file = beam
    return tesdf.encode(mesh, "fast", domain=file, deformable=True)


def test_tetrahedra_of_a_file(beam, deformable):
    (vertices, faces), file = beam
    assert deformable.certificate.domain == "conforming" and deformable.certificate.delta is not None
    assert len(deformable.sections["domain.tetrahedra"]) == 576
    classes = deformable.inspect().classes
    assert (classes.surface_vertices, classes.inner_vertices, classes.outer_vertices) == (42, 3, 7 * 5 * 5 - 45)
    assert classes.boundary_inner_tetrahedra + classes.inner_tetrahedra == 96
    assert classes.boundary_outer_tetrahedra + classes.outer_tetrahedra == 480
    points = np.random.default_rng(1).uniform(-1, 7, (500, 3))
    distances, _ = sdf(vertices, faces, points)
    assert np.abs(deformable.signed_distance(points) - distances).max() < 1e-11
    assert deformable.verify(samples=400).passed
    same = tesdf.encode((vertices, faces), "fast", domain=str(file), deformable=True)
    assert same.to_bytes() == deformable.to_bytes()


def test_plain_and_truncated(beam):
    mesh, file = beam
    plain = tesdf.encode(mesh, domain=file, plain=True)
    assert plain.statistics.listed_cells == 576 and not plain.certificate.truncated
    short = tesdf.encode(mesh, domain=file, plain=True, e_max=8)
    assert short.certificate.truncated and short.statistics.longest_list == 8 < plain.statistics.longest_list
    assert 0 < short.certificate.exactness_distance < short.statistics.diagonal


def test_json_of_the_authors(beam, tmp_path):
    (vertices, faces), file = beam
    asset = tesdf.encode((vertices, faces), "fast", domain=file, plain=True)
    asset.export_json(tmp_path / "beam.json")
    again = tesdf.import_json(str(tmp_path / "beam.json"))
    assert again.certificate.delta is None and again.certificate.domain == "conforming"
    assert again.source.name == "beam.json" and again.inspect().classes == asset.inspect().classes
    assert again.statistics.entries == asset.statistics.entries
    report = again.verify(samples=200)
    assert report.passed and not report.certified and (report.cells, report.cell_points) == (576, 800)
    points = np.random.default_rng(1).uniform(-1, 7, (500, 3))
    assert np.abs(again.signed_distance(points) - asset.signed_distance(points)).max() < 1e-12
    with pytest.raises(tesdf.EncodeError, match='domain="gmsh", plain=True'):
        tesdf.encode((vertices, faces), "fast").export_json(tmp_path / "a.json")
    with pytest.raises(FileNotFoundError, match="none.json"):
        tesdf.import_json(tmp_path / "none.json")
    (tmp_path / "bad.json").write_text((tmp_path / "beam.json").read_text().replace('"num_of_faces":', '"num_of_faces":1'))
    with pytest.raises(tesdf.MeshError, match="bad.json: num_of_faces: 1"):
        tesdf.import_json(tmp_path / "bad.json")


def test_gmsh(beam):
    mesh, _ = beam
    asset = tesdf.encode(mesh, "fast", domain="gmsh", band=0.5)
    assert asset.certificate.domain == "conforming" and asset.inspect().classes.boundary_outer_tetrahedra > 0
    assert asset.verify(samples=200).passed
    assert tesdf.encode(CUBE, "paper", domain="gmsh", resolution=4).inspect().classes.outer_vertices == 0


def test_sampled():
    paper = tesdf.encode(TETRAHEDRON, "paper", resolution=4)
    assert (paper.certificate.encoder, paper.certificate.domain, paper.certificate.delta) == ("sampled", "bisection", None)
    narrow, wide = (tesdf.encode(CUBE, encoder="sampled", resolution=4, threshold=t, band=0.02) for t in (None, 1e-3))
    assert wide.certificate.encoder == "sampled" and wide.certificate.delta is None
    assert wide.statistics.listed_cells == narrow.statistics.listed_cells
    assert wide.statistics.entries > narrow.statistics.entries
    safe = tesdf.encode(TETRAHEDRON, encoder="sampled", threshold="safe")
    assert safe.certificate.encoder == "sampled" and safe.certificate.delta is not None
    assert tesdf.encode(TETRAHEDRON, "sampled-safe").verify(samples=200).passed


def test_certified_and_bisection_are_the_defaults():
    named = tesdf.encode(TETRAHEDRON, domain="bisection", encoder="certified")
    assert named.to_bytes() == tesdf.encode(TETRAHEDRON).to_bytes()
    assert named.inspect().classes is None


@pytest.mark.parametrize("options, text", [
    (dict(preset="paper", encoder="certified"), "encoder `certified`: the preset"),
    (dict(resolution=8), "resolution and threshold are of the encoder `sampled`"),
    (dict(threshold="safe", preset="fast"), "resolution and threshold are of the encoder `sampled`"),
    (dict(domain="tetrahedra.msh", band=0.1), "band and region: the tetrahedra of the file are the domain"),
    (dict(domain="tetrahedra.msh", regions=[[0, 0, 0, 1, 1, 1]]), "band and region"),
    (dict(plain=True), "plain: the bisection domain"),
    (dict(deformable=True), "deformation"),
    (dict(encoder="sampled", resolution=0), "resolution is 0; expected 1 to 1024"),
    (dict(encoder="sampled", threshold=-1.0), "threshold is -1; expected a length"),
    (dict(domain="gmsh", band=0.0), "the band of 0e0 is no layer"),
])
def test_options_that_exclude_each_other(options, text):
    with pytest.raises(tesdf.EncodeError, match=text):
        tesdf.encode(TETRAHEDRON, **options)


@pytest.mark.parametrize("options, error, text", [
    (dict(encoder="voxels"), ValueError, "encoder: 'voxels'; expected 'certified' or 'sampled'"),
    (dict(encoder="sampled", threshold="wide"), ValueError, "threshold: 'wide'; expected a length of 0 or more, 'safe', or 'squared:'"),
    (dict(e_max=0), ValueError, "e_max: 0; expected an integer from 1 to"),
    (dict(domain=3), ValueError, "domain: int; expected 'bisection', 'gmsh' or a path"),
    (dict(domain="none.msh"), FileNotFoundError, "cannot read none.msh"),
    (dict(domain="voxels"), tesdf.MeshError, "voxels: the extension names no format of tetrahedra"),
])
def test_invalid_options_are_errors(options, error, text):
    with pytest.raises(error, match=text):
        tesdf.encode(TETRAHEDRON, **options)


def test_tetrahedra_of_another_mesh(beam, tmp_path):
    _, file = beam
    with pytest.raises(tesdf.EncodeError, match="beam.node: .*"):
        tesdf.encode(CUBE, domain=file)
    broken = tmp_path / "broken.msh"
    broken.write_text("$MeshFormat\n9 0 8\n$EndMeshFormat\n")
    with pytest.raises(tesdf.MeshError, match="broken.msh: Gmsh MSH, line"):
        tesdf.encode(CUBE, domain=broken)


def test_moved_vertices(beam, deformable, tmp_path):
    (vertices, faces), _ = beam
    before = deformable.to_bytes()
    # The end of the beam, and the vertices of the domain around it.
    places = np.concatenate([deformable.vertices, deformable.sections["domain.vertices"]])
    ids = np.flatnonzero(places[:, 0] > 3.5)
    turn = 0.1 * (places[ids, 0] - 3)
    positions = places[ids] + np.stack([np.zeros(len(ids)), turn, -0.5 * turn], 1)
    moved = deformable.move_vertices(ids, positions)
    assert moved.inverted.tolist() == [] and 0 < moved.faces < len(faces) and 0 < moved.tetrahedra < 576
    assert deformable.to_bytes() == before and len(deformable.stale_cells()) == 0

    bent = vertices.copy()
    bent[ids[ids < len(vertices)]] = positions[ids < len(vertices)]
    assert np.array_equal(moved.asset.vertices, bent) and np.array_equal(deformable.vertices, vertices)
    assert np.array_equal(moved.asset.bounds, [bent.min(0), bent.max(0)])
    assert moved.asset.certificate.delta is None

    stale = moved.asset.stale_cells()
    again = moved.asset.reencode_stale()
    assert np.array_equal(again.stale, stale) and 0 < len(stale) <= again.checked <= again.cells
    assert len(again.asset.stale_cells()) == 0 and len(moved.asset.stale_cells()) == len(stale)
    assert again.asset.certificate.delta is not None and again.asset.verify(samples=400).passed
    points = np.random.default_rng(2).uniform(0, 6, (500, 3))
    distances, _ = sdf(bent, faces, points)
    answers = again.asset.query(points)
    assert np.abs(answers.signed_distance - distances).max() < 1e-11

    again.asset.save(tmp_path / "bent.tesdf")
    for copy in (tesdf.Asset.open(tmp_path / "bent.tesdf"), pickle.loads(pickle.dumps(again.asset))):
        assert copy.to_bytes() == again.asset.to_bytes() != before
        assert np.array_equal(copy.query(points).signed_distance, answers.signed_distance)
        for name, array in copy.sections.items():
            assert np.array_equal(array, again.asset.sections[name]), name


def test_invalid_moves_are_errors(asset, deformable):
    with pytest.raises(tesdf.DeformError, match="bisection domain"):
        asset.move_vertices([0], [[0, 0, 0]])
    for ids, positions, error, text in [
        ([175], [[0, 0, 0]], tesdf.DeformError, "vertex 175 of 175"),
        ([0], [[np.nan, 0, 0]], tesdf.DeformError, "expected finite numbers"),
        ([-1], [[0, 0, 0]], ValueError, "vertices: the id -1; expected ids from 0"),
        ([0.5], [[0, 0, 0]], ValueError, "vertices: an array of float64; expected integers"),
        ([[0]], [[0, 0, 0]], ValueError, r"vertices: an array of shape \(1, 1\); expected shape \(N,\)"),
        ([0, 1], [[0, 0, 0]], ValueError, "positions: 1 of 2 vertices; expected one for each vertex"),
        ([0], [0, 0, 0], ValueError, r"positions: an array of shape \(3,\)"),
    ]:
        with pytest.raises(error, match=text):
            deformable.move_vertices(ids, positions)
