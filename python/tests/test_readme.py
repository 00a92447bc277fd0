"""Runs the code of both READMEs, and compares the docstrings of the stubs."""

from pathlib import Path

import pytest
import tesdf
from stub_docstrings import STUBS, with_docstrings
from test_simulation import SCENE

PYTHON = Path(__file__).resolve().parents[1]


@pytest.fixture
def run(torus, tmp_path, monkeypatch):
    """Runs the Python code of a document beside part.obj and scene.toml. Gives its variables."""
    monkeypatch.chdir(tmp_path)
    vertices, faces = torus
    faces = "".join(f"f {a} {b} {c}\n" for a, b, c in faces + 1)
    Path("part.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in vertices) + faces)
    Path("scene.toml").write_text(SCENE)

    def run(path, count):
        blocks = [block.split("```")[0] for block in path.read_text().split("```python\n")[1:]]
        assert len(blocks) == count
        names = {}
        for block in blocks:
            exec(block.replace("part.stl", "part.obj").replace("1_000_000", "1000"), names)
        return names

    return run


def test_the_code_of_the_package_runs(run):
    names = run(PYTHON / "README.md", 7)
    assert names["summary"]["passed"] and Path("run.tesrun").exists()
    assert abs(names["simulation"].coordinates[0] - 0.1) < 1e-3
    assert len(names["contacts"]) > 1000 and isinstance(names["contacts"], tesdf.Contacts)


def test_the_code_of_the_project_runs(run):
    names = run(PYTHON.parent / "README.md", 2)
    assert len(names["contacts"]) > 100 and Path("part.tesdf").exists()
    assert (names["answers"].signed_distance == names["part"].signed_distance(names["points"])).all()


def test_the_stubs_have_the_docstrings_of_the_module():
    text = STUBS.read_text()
    assert with_docstrings(text) == text, "run python python/tests/stub_docstrings.py"
    assert text.count('"""') > 200
