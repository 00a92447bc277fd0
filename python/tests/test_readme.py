"""Runs the code of the README."""

from pathlib import Path

import tesdf
from test_simulation import SCENE


def test_the_code_of_the_readme_runs(torus, tmp_path, monkeypatch):
    text = (Path(__file__).resolve().parents[1] / "README.md").read_text()
    blocks = [block.split("```")[0] for block in text.split("```python\n")[1:]]
    assert len(blocks) == 3
    monkeypatch.chdir(tmp_path)
    vertices, faces = torus
    faces = "".join(f"f {a} {b} {c}\n" for a, b, c in faces + 1)
    Path("part.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in vertices) + faces)
    Path("scene.toml").write_text(SCENE)
    names = {}
    for block in blocks:
        exec(block.replace("part.stl", "part.obj").replace("1_000_000", "1000"), names)
    assert names["summary"]["passed"] and Path("run.tesrun").exists()
    assert len(names["contacts"]) > 1000 and isinstance(names["contacts"], tesdf.Contacts)
