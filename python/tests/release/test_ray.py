"""The example for Ray encodes each of many meshes once, even if a worker dies."""

import importlib.util
import os
import signal
import threading
import time
import uuid
from pathlib import Path

import numpy as np
import pytest
import tesdf
from conftest import TETRAHEDRON

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "python" / "ray_encode.py"
COUNT = 1000


@pytest.fixture(scope="module")
def meshes(tmp_path_factory):
    """Tetrahedra of random shapes; every hundredth mesh is open."""
    folder = tmp_path_factory.mktemp("meshes")
    random = np.random.default_rng(7)
    corners, faces = TETRAHEDRON
    for k in range(COUNT):
        moved = corners + random.uniform(0, 0.2, corners.shape)
        lines = [f"v {x} {y} {z}" for x, y, z in moved]
        lines += [f"f {a} {b} {c}" for a, b, c in faces[: 3 if k % 100 == 99 else 4] + 1]
        (folder / f"mesh {k}.obj").write_text("\n".join(lines) + "\n")
    return sorted(folder.iterdir())


def worker_of(mark):
    """The id of a process that runs the example's task for this test. Others may use Ray, too."""
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if (process / "cmdline").read_bytes().startswith(b"ray::encode") and mark in (process / "environ").read_bytes():
                return int(process.name)
        except OSError:  # it ended, or it is another user's
            pass
    return None


def test_a_thousand_meshes_and_a_worker_that_dies(meshes, tmp_path, monkeypatch):
    mark = f"tesdf-test-{uuid.uuid4()}"
    monkeypatch.setenv("TESDF_TEST", mark)
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    import ray

    spec = importlib.util.spec_from_file_location("ray_encode", EXAMPLE)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    killed, written_then = [], []

    def kill():
        while len(killed) < 2:
            written = len(list(tmp_path.glob("*.tesdf")))
            worker = worker_of(mark.encode()) if written >= 100 * (len(killed) + 1) else None
            if worker is not None:
                try:
                    os.kill(worker, signal.SIGKILL)
                except ProcessLookupError:  # it ended by itself
                    continue
                killed.append(worker)
                written_then.append(written)
            time.sleep(0.01)

    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    try:
        killer = threading.Thread(target=kill, daemon=True)
        killer.start()
        results = list(example.encode_all(meshes, tmp_path))
        killer.join(timeout=60)
    finally:
        ray.shutdown()
    assert len(killed) == 2 and written_then[-1] < COUNT - 10

    # Each mesh is there once, and the bad ones have their errors.
    assert sorted(mesh for mesh, *_ in results) == meshes
    errors = [(mesh, error) for mesh, asset, error in results if asset is None]
    assert sorted(mesh for mesh, _ in errors) == [mesh for mesh in meshes if mesh.stem.endswith("99")]
    assert all("no well-defined inside" in error for _, error in errors)
    # A worker that died may leave a file of another name, which the next save removes.
    assets = sorted(asset for _, asset, _ in results if asset)
    assert sorted(tmp_path.glob("*.tesdf")) == assets and len(set(assets)) == COUNT - len(errors)
    for mesh, asset, _ in results:
        if asset:
            assert asset.read_bytes() == tesdf.encode(mesh, "fast").to_bytes(), mesh
