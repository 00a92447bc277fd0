"""Runs the code of docs that needs MJWarp, PyTorch, JAX or usd-core."""

from pathlib import Path

import numpy as np
import tesdf
from conftest import PARTS, python_blocks
from test_documents import names_of_mujoco
from test_usd import POINTS, cube, path_of, stage  # noqa: F401
from unoptimised_kernels import unoptimised


def test_code_of_pytorch(part):
    [code] = python_blocks("docs/integrations.md", "PyTorch")
    # The peg is apart, and overlaps.
    meshes = {"part.stl": "part.obj", "peg.stl": PARTS / "lobed_peg.obj", "hole.stl": PARTS / "lobed_hole_c100.obj"}
    for name, file in meshes.items():
        code = code.replace(name, str(file))
    for at in ([0.1, 0, 0], [3e-4, 0, 0.018]):
        names = {}
        exec(code.replace("[0.1, 0, 0, ", str(at)[:-1] + ", "), names)
        pose, points = names["pose"], names["points"]
        expected = tesdf.clearance(meshes["peg.stl"], meshes["hole.stl"], pose.detach().numpy()).distance
        assert names["room"].item() == np.float32(expected)
        assert pose.grad.isfinite().all() and pose.grad.abs().max() > 0.1 and points.grad.abs().max() > 0.5
        assert (len(names["depths"]) > 0) == (expected <= 0)
        # At 1 m/s. Bodies that overlap meet at the start.
        assert 0.05 < names["time"] < 0.1 if expected > 0 else names["time"] == 0


def test_code_of_mjwarp(part):
    unoptimised()
    [code] = python_blocks("docs/integrations.md", "MJWarp")
    names = names_of_mujoco()
    exec(code, names)
    assert (names["d"].time.numpy() > 0).all() and len(names["d"].time) == 16
    assert names["d"].nacon.numpy()[0] >= 4 * 16


def test_code_of_jax(part):
    [code] = python_blocks("docs/integrations.md", "JAX")
    names = {}
    exec(code.replace("part.stl", "part.obj"), names)
    exact = tesdf.Asset.query(tesdf.encode("part.obj", "fast"), np.asarray(names["points"], float))
    np.testing.assert_allclose(names["distance"], exact.signed_distance, atol=1e-6)
    np.testing.assert_allclose(names["push"], exact.gradient, atol=1e-4)


def test_code_of_usd(stage, monkeypatch):  # noqa: F811
    cube(stage, "/World/gripper")
    monkeypatch.chdir(Path(path_of(stage)).parent)
    [code] = python_blocks("docs/formats.md", "USD")
    names = {}
    exec(code, names)
    assert len(names["mesh"].vertices) == len(POINTS) and names["asset"].bounds.tolist() == [[0, 0, 0], [1, 1, 1]]
