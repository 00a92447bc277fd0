"""Runs the code of docs that needs no other program than MuJoCo and Gmsh; release/test_code_of_documents.py has the rest."""

import os
import shlex
import subprocess
from pathlib import Path

import numpy as np
import tesdf
from conftest import DATA, PARTS, SCREW, python_blocks


def test_code_of_planners(part):
    [code] = python_blocks("docs/integrations.md", "Planners")
    names = {"arm.urdf": DATA / "robots" / "six-axis-arm.urdf", "part.stl": "part.obj"}
    for name, file in names.items():
        code = code.replace(name, str(file))
    names = {}
    exec(code, names)
    assert names["found"].distance > 0 and names["check"].verdict == "free"
    assert ("tool", "part") not in names["robot"].checked_pairs and ("hand", "part") in names["robot"].checked_pairs


def names_of_mujoco():
    """The variables after the code of MuJoCo."""
    [code] = python_blocks("docs/integrations.md", "MuJoCo")
    # A cube of 20 mm on another one: a bolt takes longer to encode.
    for name in ("iso_m16_bolt_6k.obj", "iso_m16_nut_c100.obj"):
        assert name in SCREW
    model = SCREW.replace("iso_m16_bolt_6k.obj", "cube.obj").replace("iso_m16_nut_c100.obj", "cube.obj")
    Path("screw.xml").write_text(model.replace("0 0 0.036", "0 0 0.06"))
    for name in ("bolt.stl", "nut.stl"):
        code = code.replace(name, str(PARTS / "cube.obj"))
    assert "data.time < 1.0" in code
    names = {}
    exec(code.replace("data.time < 1.0", "data.time < 0.005"), names)
    return names


def test_code_of_mujoco(part):
    data = names_of_mujoco()["data"]
    assert data.time > 0.005 and data.ncon >= 4


def test_code_of_json_files(part):
    [code] = python_blocks("docs/formats.md", "JSON of TES-Encoder")
    names = {}
    exec(code.replace("bolt.stl", str(PARTS / "cube.obj")), names)
    assert names["bolt"].certificate.delta is None
    points = np.random.default_rng(1).normal(scale=0.02, size=(1000, 3))
    assert np.array_equal(names["plain"].signed_distance(points), tesdf.Asset.open("bolt.tesdf").signed_distance(points))


def test_commands_of_json_files(part):
    text = (DATA.parent / "docs" / "formats.md").read_text(encoding="utf-8").split("\n## JSON of TES-Encoder\n")[1]
    commands = [line.strip() for line in text.split("```")[0].splitlines() if line.startswith("    ")]
    assert [command.split()[1] for command in commands] == ["encode", "export", "import", "verify"]
    for command in commands:
        program, *arguments = shlex.split(command.replace("bolt.stl", str(PARTS / "cube.obj")))
        assert program == "tesdf"
        subprocess.run([os.environ["TESDF_CLI"], *arguments], check=True, capture_output=True)
    assert Path("bolt.json").exists() and Path("bolt.tesdf").exists()
