import sys
from pathlib import Path

import numpy as np
import pytest
import tesdf

DATA = Path(__file__).resolve().parents[2] / "data"
sys.path[:0] = [str(DATA), str(DATA / "reference")]

TETRAHEDRON = (
    np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
)


@pytest.fixture(scope="session")
def torus():
    """major radius 1, minor radius 0.4, 600 faces; in memory"""
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
    """in and around the torus, near its surface, and far away"""
    random = np.random.default_rng(1)
    vertices, faces = torus
    corners = vertices[faces[random.integers(len(faces), size=600)]]
    on_surface = (random.dirichlet([1, 1, 1], 600)[:, :, None] * corners).sum(1)
    near = on_surface + random.normal(size=(600, 3)) * 10.0 ** random.uniform(-6, -1, (600, 1))
    return np.concatenate([random.uniform(-1.6, 1.6, (600, 3)), near, random.uniform(-50, 50, (50, 3))])
