"""Runs the code of both READMEs, and compares the docstrings of the stubs."""

from pathlib import Path

import pytest
import tesdf
from conftest import python_blocks
from stub_docstrings import STUBS, with_docstrings
from test_simulation import SCENE

@pytest.fixture
def run(part):
    """Runs the Python code of a document beside part.obj and scene.toml. Gives its variables."""
    Path("scene.toml").write_text(SCENE)

    def run(document, count):
        blocks = python_blocks(document)
        assert len(blocks) == count
        names = {}
        for block in blocks:
            exec(block.replace("part.stl", "part.obj").replace("1_000_000", "1000"), names)
        return names

    return run


def test_the_code_of_the_package_runs(run):
    names = run("python/README.md", 7)
    assert names["summary"]["passed"] and Path("run.tesrun").exists()
    assert abs(names["simulation"].coordinates[0] - 0.1) < 1e-3
    assert len(names["contacts"]) > 1000 and isinstance(names["contacts"], tesdf.Contacts)


def test_the_code_of_the_project_runs(run):
    names = run("README.md", 2)
    assert len(names["contacts"]) > 100 and Path("part.tesdf").exists()
    assert (names["answers"].signed_distance == names["part"].signed_distance(names["points"])).all()


def test_the_stubs_have_the_docstrings_of_the_module():
    text = STUBS.read_text()
    assert with_docstrings(text) == text, "run python python/tests/stub_docstrings.py"
    assert text.count('"""') > 200
