"""Recordings for rerun have the bodies of a run and their poses."""

import numpy as np
import pytest
import tesdf
from rerun.chunk import RrdReader

SCENE = {
    "time_step": 2e-3,
    "duration": 0.1,
    "bodies": [
        {"name": "floor", "shape": "plane", "fixed": True, "translation": [100, 0, 0]},
        {"name": "box a/b", "shape": {"box": {"half_extents": [0.01, 0.02, 0.03]}}, "mass": 0.1,
         "translation": [100, 0.2, 0.1], "velocity": [0.1, 0, 0], "angular_velocity": [0, 0, 2]},
        {"name": "post", "shape": {"capsule": {"half_height": 0.02, "radius": 0.005}}, "fixed": True,
         "translation": [99.95, 0, 0.025], "rotation": [0, 0, 0.6, 0.8]},
    ],
}


@pytest.fixture(scope="module")
def simulation():
    simulation = tesdf.Simulation(SCENE)
    simulation.run()
    return simulation


def columns_of(path):
    """[times, rows] of each component, by entity and name of the component"""
    found = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        times = batch.column("time").cast("int64").to_numpy() * 1e-9 if "time" in batch.schema.names else None
        for name in batch.schema.names:
            if ":" in name:
                found[chunk.entity_path, name.split(":")[1]] = times, batch.column(name).to_pylist()
    return found


def test_a_recording_has_the_poses_of_the_run(simulation, tmp_path):
    tesdf.export(simulation, tmp_path / "run.rrd")
    found, record = columns_of(tmp_path / "run.rrd"), simulation.record()
    [[centre]] = found["/run", "translation"][1]
    assert abs(centre[0] - 100) < 0.1
    times, places = found["/run/box\\ a\\/b", "translation"]
    assert np.abs(times - record.times).max() < 1e-6 and len(places) == len(record.times) == 51
    assert np.abs(np.array(places)[:, 0] + centre - record.poses[:, 1, :3]).max() < 4e-6  # float32 at 100 m
    [turned] = [rows for (entity, name), (_, rows) in found.items() if "box" in entity and name == "quaternion"]
    assert np.abs(np.abs((np.array(turned)[:, 0] * record.poses[:, 1, 3:]).sum(1)) - 1).max() < 1e-6
    [post] = found["/run/post", "quaternion"][1]
    assert np.abs(np.array(post[0]) - [0, 0, 0.6, 0.8]).max() < 1e-6
    [corners] = [rows[0] for (entity, name), (_, rows) in found.items() if "box" in entity and name == "vertex_positions"]
    assert np.abs(np.abs(corners).max(0) - [0.01, 0.02, 0.03]).max() < 1e-7
    assert ("/run/floor/mesh_0", "triangle_indices") in found


def test_what_a_recording_refuses(simulation, tmp_path):
    with pytest.raises(ValueError, match="speed: 2.0; expected 1 for a .rrd file"):
        tesdf.export(simulation, tmp_path / "run.rrd", speed=2.0)
    with pytest.raises(FileNotFoundError):
        tesdf.export(tmp_path / "no.tesrun", tmp_path / "run.rrd")
    assert not (tmp_path / "run.rrd").exists()
