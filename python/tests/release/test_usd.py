"""Meshes of USD files, through usd-core."""

import sys

import numpy as np
import pytest
import tesdf
from pxr import Gf, Usd, UsdGeom

# A cube from 0 to 1 of six quadrilaterals, outward.
POINTS = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
QUADS = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]


def cube(stage, path, **attributes):
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(POINTS)
    mesh.CreateFaceVertexCountsAttr([4] * 6)
    mesh.CreateFaceVertexIndicesAttr(attributes.get("corners", QUADS))
    mesh.CreateSubdivisionSchemeAttr(attributes.get("scheme", "none"))
    mesh.CreateOrientationAttr(attributes.get("orientation", "rightHanded"))
    return mesh


@pytest.fixture
def stage(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "scene.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, "Z")
    return stage


def path_of(stage):
    stage.Save()
    return stage.GetRootLayer().realPath


def volume(vertices, faces):
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def test_transforms_units_and_names(stage):
    world = UsdGeom.Xform.Define(stage, "/World")
    world.AddTranslateOp().Set(Gf.Vec3d(10, 0, 0))
    near = cube(stage, "/World/near")
    near.AddRotateZOp().Set(90)
    near.AddScaleOp().Set(Gf.Vec3f(2, 1, 1))
    far = cube(stage, "/World/far", scheme="catmullClark")
    far.AddTranslateOp().Set(Gf.Vec3d(0, 5, 0))
    path = path_of(stage)

    mesh = tesdf.read_usd(path)
    assert (mesh.unit, mesh.up_axis, mesh.prims) == ("cm", "Z", ("/World/near", "/World/far"))
    assert len(mesh.faces) == 24 and "control mesh of 1 meshes" in mesh.notes[0]
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(3, abs=1e-12)
    one = tesdf.read_usd(path, prim="/World/near")
    # Scaled by 2 along x, turned to y, then moved.
    assert np.allclose([one.vertices.min(0), one.vertices.max(0)], [[9, 0, 0], [10, 2, 1]], atol=1e-12)

    asset = tesdf.encode(path)
    assert (asset.unit, asset.source.name, len(asset.source.blake3)) == ("cm", "scene.usda", 64)
    assert asset.signed_distance([[9.5, 1.0, 0.25], [10.5, 5.5, 0.9]]) == pytest.approx([-0.25, -0.1], abs=1e-12)
    assert len(tesdf.encode(one, unit=one.unit).faces) == 12
    assert tesdf.check(path).encodable and len(tesdf.repair(path).faces) == 24
    with pytest.warns(UserWarning, match="the file is in cm, but the unit m was given"):
        assert tesdf.encode(path, unit="m").unit == "m"


def test_left_handed_and_mirrored_meshes_point_outward(stage):
    inside_out = [QUADS[4 * i + (3 - j)] for i in range(6) for j in range(4)]
    cube(stage, "/left", orientation="leftHanded", corners=inside_out)
    mirrored = cube(stage, "/mirrored")
    mirrored.AddScaleOp().Set(Gf.Vec3f(-1, 1, 1))
    both = cube(stage, "/both", orientation="leftHanded", corners=inside_out)
    both.AddTransformOp().Set(Gf.Matrix4d(-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1))
    path = path_of(stage)
    for prim in ("/left", "/mirrored", "/both"):
        mesh = tesdf.read_usd(path, prim=prim)
        assert volume(mesh.vertices, mesh.faces) == pytest.approx(1, abs=1e-12), prim


def test_what_is_not_shown_is_left_out(stage):
    cube(stage, "/shown")
    cube(stage, "/hidden").MakeInvisible()
    cube(stage, "/guide").CreatePurposeAttr("guide")
    path = path_of(stage)
    mesh = tesdf.read_usd(path)
    assert mesh.prims == ("/shown",)
    assert mesh.notes[0] == "meshes left out (1 invisible, 1 of the purpose guide: name it by prim to read it)"
    assert tesdf.read_usd(path, prim="/guide").prims == ("/guide",)


def test_instances_and_packages(stage, tmp_path):
    cube(stage, "/Part/mesh")
    for name, x in (("a", 2), ("b", 4)):
        instance = UsdGeom.Xform.Define(stage, f"/{name}")
        instance.GetPrim().GetReferences().AddInternalReference("/Part")
        instance.GetPrim().SetInstanceable(True)
        instance.AddTranslateOp().Set(Gf.Vec3d(x, 0, 0))
    path = path_of(stage)
    mesh = tesdf.read_usd(path)
    assert mesh.prims == ("/Part/mesh", "/a/mesh", "/b/mesh")
    assert mesh.vertices[:, 0].max() == 5
    stage.Export(str(tmp_path / "scene.usdc"))
    assert np.array_equal(tesdf.read_usd(tmp_path / "scene.usdc").vertices, mesh.vertices)


def test_errors_say_what_to_do(stage, tmp_path, monkeypatch):
    with pytest.raises(OSError):
        tesdf.read_usd(tmp_path / "none.usd")
    (tmp_path / "broken.usda").write_text("no USD")
    with pytest.raises(tesdf.MeshError, match="USD cannot open it"):
        tesdf.encode(tmp_path / "broken.usda")
    cube(stage, "/cube", corners=[*QUADS[:-1], 8])
    path = path_of(stage)
    with pytest.raises(tesdf.MeshError, match="/cube: faceVertexIndices are from 0 to 8, and there are 8 points"):
        tesdf.read_usd(path)
    with pytest.raises(tesdf.MeshError, match="there is no prim /x"):
        tesdf.read_usd(path, prim="/x")
    cube(stage, "/cube", corners=QUADS[:-1])
    with pytest.raises(tesdf.MeshError, match="add up to 24"):
        tesdf.read_usd(path_of(stage))
    UsdGeom.Xform.Define(stage, "/empty")
    with pytest.raises(tesdf.MeshError, match="no mesh at or below /empty"):
        tesdf.read_usd(path_of(stage), prim="/empty")
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(ImportError, match="pip install usd-core"):
        tesdf.encode(path)
