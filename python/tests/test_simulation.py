"""Simulations of scene files against the command `tesdf simulate`."""

import json
import os
import subprocess

import numpy as np
import pytest
import tesdf
from ctrl_c import ended_by_ctrl_c

SCENE = """
time_step = 1e-3
duration = 0.12

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "box"
shape = { box = { half_extents = [0.05, 0.04, 0.03] } }
density = 1000
translation = [0, 0, 0.035]

[record]
contacts_every = 2

[criterion.rest]
after = 0.1
max_drift = 1e-4
max_energy_gain = 1e-6
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


def test_a_run_is_that_of_the_command(scene, tmp_path):
    program = os.environ.get("TESDF_CLI")
    assert program, "TESDF_CLI must name the program tesdf, as .ci/python.sh builds it"
    command = [program, "simulate", scene, "-o", tmp_path / "command.tesrun", "--json"]
    expected = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
    # In several calls, and with another number of threads.
    simulation = tesdf.Simulation(scene, threads=2)
    simulation.step()
    simulation.step(count=49)
    assert (simulation.steps, simulation.planned_steps) == (50, 120)
    summary = simulation.run()
    simulation.save(tmp_path / "python.tesrun")
    assert (tmp_path / "python.tesrun").read_bytes() == (tmp_path / "command.tesrun").read_bytes()
    timings = ("detection_ms", "solution_ms")
    assert {k: v for k, v in summary.items() if k not in timings} == {k: expected[k] for k in summary if k not in timings}
    assert summary["passed"] and summary["steps"] == 120 and summary["rest"]["failures"] == []


def test_a_box_falls_and_lands(scene):
    simulation = tesdf.Simulation(scene)
    assert simulation.bodies == ["floor", "box"] and simulation.time == 0 and len(simulation.contacts) == 0
    assert simulation.poses.tolist() == [[0, 0, 0, 0, 0, 0, 1], [0, 0, 0.035, 0, 0, 0, 1]]
    simulation.step(20)
    assert simulation.velocities[1] == pytest.approx([0, 0, -9.81 * 0.02, 0, 0, 0])
    simulation.run()
    assert simulation.poses[1] == pytest.approx([0, 0, 0.03, 0, 0, 0, 1], abs=1e-6) and simulation.time == pytest.approx(0.12)
    found = simulation.contacts
    assert len(found) >= 4 and np.abs(found.distance).max() < 1e-5 and len(found.hidden) == 0
    assert set(found.instance_a.tolist()) | set(found.instance_b.tolist()) == {0, 1}
    record = simulation.record()
    assert record.times.shape == (121,) and record.poses.shape == (121, 2, 7) and record.velocities.shape == (121, 2, 6)
    assert np.array_equal(record.poses[-1], simulation.poses) and np.array_equal(record.velocities[-1], simulation.velocities)
    assert record.contact_steps.tolist() == list(range(0, 120, 2)) and set(record.steps) <= set(record.contact_steps)
    assert record.points.shape == (len(record.steps), 3) and record.bodies.max() == 1
    # More steps than the scene's duration.
    simulation.step(10)
    assert simulation.steps == 130 and repr(simulation) == "<tesdf.Simulation: 2 bodies, step 130 of 120>"


def test_options(scene):
    simulation = tesdf.Simulation(scene, mode="off", time_step=2e-3, duration=0.01)
    assert simulation.planned_steps == 5 and not simulation.run()["passed"] is None
    seen = []
    tesdf.Simulation(scene).run(progress=lambda done, planned: seen.append((done, planned)))
    assert seen[-1] == (120, 120) and seen == sorted(seen)


def test_errors(scene, tmp_path):
    with pytest.raises(FileNotFoundError, match="none.toml"):
        tesdf.Simulation(tmp_path / "none.toml")
    with pytest.raises(ValueError, match="mode: 'nodes'; expected 'node', 'edge', 'face', 'exact' or 'off'"):
        tesdf.Simulation(scene, mode="nodes")
    with pytest.raises(tesdf.SimulationError, match="duration.*-1; expected a number of seconds above 0"):
        tesdf.Simulation(scene, duration=-1)
    with pytest.raises(TypeError):
        tesdf.Simulation(scene, "node")
    with pytest.raises(FileNotFoundError):
        tesdf.Simulation(scene).save(tmp_path / "nowhere" / "run.tesrun")
    scene.write_text(SCENE.replace("density = 1000", "density = -1"))
    with pytest.raises(tesdf.SceneError, match="scene.toml, line 10, body box"):
        tesdf.Simulation(scene)
    scene.write_text(SCENE.replace("fixed", "fixt"))
    with pytest.raises(tesdf.SceneError, match="(?s)scene.toml: .*unknown field `fixt`"):
        tesdf.Simulation(scene)


def test_an_exception_of_progress_ends_a_run(scene):
    simulation = tesdf.Simulation(scene, duration=1000)

    def stop(done, planned):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        simulation.run(progress=stop)
    done = simulation.steps
    assert 0 < done < simulation.planned_steps
    simulation.step()
    assert simulation.steps == done + 1


def test_ctrl_c_ends_a_run(scene):
    body = ["simulation = tesdf.Simulation(sys.argv[1], duration=1000)", "print('started', flush=True)", "simulation.run()"]
    ended_by_ctrl_c(body, scene)
