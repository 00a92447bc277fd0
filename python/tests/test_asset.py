"""Files, views and metadata of assets."""

import gc
import json
import pickle
import struct

import numpy as np
import pytest
import tesdf


@pytest.fixture
def file(asset, tmp_path):
    path = tmp_path / "torus.tesdf"
    asset.save(path)
    return path


def test_save_and_open(asset, file, points):
    opened = tesdf.Asset.open(file)
    assert opened.to_bytes() == asset.to_bytes() == file.read_bytes()
    for a, b in zip(opened.query(points), asset.query(points)):
        assert np.array_equal(a, b)
    assert tesdf.Asset.open(str(file)).certificate == asset.certificate
    for copy in (tesdf.Asset.from_bytes(file.read_bytes()), pickle.loads(pickle.dumps(asset))):
        assert copy.to_bytes() == asset.to_bytes()


def test_views_are_the_file(torus, file):
    data = file.read_bytes()
    (length,) = struct.unpack("<Q", data[:8])
    header = json.loads(data[8 : 8 + length])
    sections = tesdf.Asset.open(file).sections
    assert set(sections) == set(header) - {"__metadata__"}
    types = dict(F64="<f8", F32="<f4", U32="<u4", U16="<u2", U8="u1")
    for name, array in sections.items():
        start, end = header[name]["data_offsets"]
        assert array.dtype == types[header[name]["dtype"]] and list(array.shape) == header[name]["shape"]
        assert array.tobytes() == data[8 + length + start : 8 + length + end]


def test_mesh_is_the_one_given(asset, torus):
    vertices, faces = torus
    assert np.array_equal(asset.vertices, vertices)
    assert np.array_equal(asset.faces, faces[asset.face_ids])
    assert np.array_equal(np.sort(asset.face_ids), np.arange(len(faces)))
    assert np.array_equal(asset.bounds, [vertices.min(0), vertices.max(0)])


def test_views_copy_nothing_and_keep_the_asset(file):
    asset = tesdf.Asset.open(file)
    a, b = asset.vertices, asset.vertices
    assert np.shares_memory(a, b) and not a.flags.owndata
    expected = a.copy()
    del asset, b
    gc.collect()
    file.unlink()
    assert np.array_equal(a, expected)


def test_views_cannot_be_written_to(asset):
    for name, array in asset.sections.items():
        assert not array.flags.writeable, name
        with pytest.raises(ValueError):
            array[...] = 0
        with pytest.raises(ValueError):
            array.setflags(write=True)


def test_metadata(asset, torus):
    vertices, faces = torus
    assert asset.unit == "m"
    assert asset.source.name == "" and repr(asset).startswith("<tesdf.Asset made in memory: 600 faces, ")
    certificate = asset.certificate
    assert (certificate.encoder, certificate.domain, certificate.truncated) == ("certified", "bisection", False)
    assert asset.certificate.delta == pytest.approx(asset.certificate.delta_of_diagonal * asset.statistics.diagonal)
    assert (asset.statistics.faces, asset.statistics.vertices) == (len(faces), len(vertices))
    found = asset.inspect()
    assert found.counts.listed_cells == asset.statistics.listed_cells
    assert found.memory.file == len(asset.to_bytes()) == sum(n for name, n in found.memory.parts if not name.startswith("made"))
    assert 1 <= found.lists.p50 <= found.lists.p99 <= found.lists.longest == asset.statistics.longest_list


def test_verify(asset, file):
    report = asset.verify(samples=800)
    assert report.passed and report.samples == 800
    assert [p.precision for p in report.precisions] == ["f32", "f64"]
    assert sum(c.points for c in report.precisions[0].classes) == 800
    assert report.precisions[1].largest_error_of_diagonal <= report.precisions[1].promise.of_diagonal
    data = bytearray(file.read_bytes())
    data[-1] ^= 1
    with pytest.raises(tesdf.AssetError, match="the file was damaged"):
        tesdf.Asset.from_bytes(bytes(data)).verify(samples=8)


def test_invalid_files_are_errors(tmp_path):
    with pytest.raises(FileNotFoundError, match="cannot open .*none.tesdf"):
        tesdf.Asset.open(tmp_path / "none.tesdf")
    picture = tmp_path / "picture.tesdf"
    picture.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    with pytest.raises(tesdf.AssetError, match=r"picture\.tesdf: this is .*not a \.tesdf file"):
        tesdf.Asset.open(picture)
    with pytest.raises(tesdf.AssetError):
        tesdf.Asset.from_bytes(b"")


def test_a_missing_folder_is_an_error(asset, tmp_path):
    with pytest.raises(FileNotFoundError, match="none"):
        asset.save(tmp_path / "none" / "a.tesdf")


def test_an_asset_has_no_constructor():
    with pytest.raises(TypeError):
        tesdf.Asset()
