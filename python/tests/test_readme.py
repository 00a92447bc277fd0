"""Runs the code of the README."""

from pathlib import Path

import tesdf


def test_the_code_of_the_readme_runs(torus, tmp_path, monkeypatch):
    text = (Path(__file__).resolve().parents[1] / "README.md").read_text()
    blocks = [block.split("```")[0] for block in text.split("```python\n")[1:]]
    assert len(blocks) == 2
    monkeypatch.chdir(tmp_path)
    vertices, faces = torus
    faces = "".join(f"f {a} {b} {c}\n" for a, b, c in faces + 1)
    Path("part.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in vertices) + faces)
    names = {}
    for block in blocks:
        exec(block.replace("part.stl", "part.obj").replace("1_000_000", "1000"), names)
    assert len(names["contacts"]) > 1000 and isinstance(names["contacts"], tesdf.Contacts)
