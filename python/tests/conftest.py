import os
import sys
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
import tesdf

# Tests encode their meshes.
os.environ["TESDF_CACHE"] = ""

DATA = Path(__file__).resolve().parents[2] / "data"
sys.path[:0] = [str(DATA), str(DATA / "reference")]

PARTS = DATA / "procedural"

# The bolt stands on its head, and the nut is threaded on by 4 mm.
SCREW = f"""
<mujoco>
  <option timestep="0.002" integrator="implicitfast" cone="elliptic"/>
  <size memory="100M"/>
  <asset>
    <mesh name="bolt" file="{PARTS}/iso_m16_bolt_6k.obj"/>
    <mesh name="nut" file="{PARTS}/iso_m16_nut_c100.obj"/>
  </asset>
  <worldbody>
    <body pos="0 0 0.04" quat="0 1 0 0"><geom name="bolt" type="mesh" mesh="bolt" condim="1"/></body>
    <body name="nut" pos="0 0 0.036" quat="0 1 0 0">
      <freejoint/>
      <geom name="nut" type="mesh" mesh="nut" density="7850" condim="1"/>
    </body>
  </worldbody>
</mujoco>"""

TETRAHEDRON = (
    np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
)


def python_blocks(document, section=None):
    """The blocks of Python code of a document of this repository, or of one of its sections."""
    text = (DATA.parent / document).read_text(encoding="utf-8")
    if section:
        text = text.split(f"\n## {section}\n")[1].split("\n## ")[0]
    return [block.split("```")[0] for block in text.split("```python\n")[1:]]


@pytest.fixture
def part(torus, tmp_path, monkeypatch):
    """Makes a new folder the current one, with the torus as part.obj."""
    monkeypatch.chdir(tmp_path)
    vertices, faces = torus
    corners = "".join(f"f {a} {b} {c}\n" for a, b, c in faces + 1)
    Path("part.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in vertices) + corners)


@pytest.fixture(scope="session")
def screw():
    """the assets of SCREW, by the names of its geoms"""
    return {
        "bolt": tesdf.encode(PARTS / "iso_m16_bolt_6k.obj", "fast"),
        "nut": tesdf.encode(PARTS / "iso_m16_nut_c100.obj", "fast"),
    }


@pytest.fixture(scope="session")
def torus():
    """a torus with major radius 1, minor radius 0.4 and 600 faces, as arrays"""
    m, n = 25, 12
    u, v = (2 * np.pi * np.arange(k) / k for k in (m, n))
    u, v = np.meshgrid(u, v, indexing="ij")
    ring = 1 + 0.4 * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)], -1).reshape(-1, 3)
    i, j = (x.ravel() for x in np.meshgrid(range(m), range(n), indexing="ij"))
    at = lambda i, j: i % m * n + j % n  # noqa: E731
    a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
    return vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


@pytest.fixture(scope="session")
def asset(torus):
    return tesdf.encode(torus, "fast", unit="m")


@pytest.fixture(scope="session")
def points(torus):
    """points in and around the torus, near its surface, and far away"""
    random = np.random.default_rng(1)
    vertices, faces = torus
    corners = vertices[faces[random.integers(len(faces), size=600)]]
    on_surface = (random.dirichlet([1, 1, 1], 600)[:, :, None] * corners).sum(1)
    near = on_surface + random.normal(size=(600, 3)) * 10.0 ** random.uniform(-6, -1, (600, 1))
    return np.concatenate([random.uniform(-1.6, 1.6, (600, 3)), near, random.uniform(-50, 50, (50, 3))])


@pytest.fixture(scope="session")
def beam(tmp_path_factory):
    """a beam of 4 x 2 x 2 in a grid of 6 x 4 x 4 cubes, each split into six tetrahedra: the
    beam's mesh, and the tetrahedra's file"""
    shape = np.array([6, 4, 4])
    cubes = np.stack(np.meshgrid(*map(range, shape), indexing="ij"), -1).reshape(-1, 3)
    # Paths from a corner to the opposite corner along the axes, in each order. The order decides
    # the orientation.
    walks = np.array([np.cumsum(np.vstack([np.zeros(3, int), np.eye(3, dtype=int)[list(axes)]]), 0) for axes in permutations(range(3))])
    walks[[1, 2, 5], 2:] = walks[[1, 2, 5], :1:-1]
    tetrahedra = ((cubes[:, None, None] + walks) @ [25, 5, 1]).reshape(-1, 4)
    places = np.stack(np.meshgrid(*map(range, shape + 1), indexing="ij"), -1).reshape(-1, 3).astype(float)
    inside = np.repeat(((cubes > 0) & (cubes < shape - 1)).all(1), 6)
    sides = tetrahedra[inside][:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(sides, 1), axis=0, return_index=True, return_counts=True)
    used, faces = np.unique(sides[np.sort(first[count == 1])], return_inverse=True)
    file = tmp_path_factory.mktemp("beam") / "beam.node"
    rows = lambda name, numbers: "\n".join([name] + [" ".join(map(str, [i, *row])) for i, row in enumerate(numbers)])  # noqa: E731
    file.write_text(rows(f"{len(places)} 3 0 0", places))
    file.with_suffix(".ele").write_text(rows(f"{len(tetrahedra)} 4 0", tetrahedra))
    return (places[used], faces.reshape(-1, 3)), file
