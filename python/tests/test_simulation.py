"""Simulations of scene files against the command `tesdf simulate`."""

import html
import json
import os
import pickle
import re
import subprocess
import urllib.request

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
forces_every = 60

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
    assert record.force_steps.tolist() == [0, 60] and len(record.joint_forces) == 0
    last = record.contact_forces.forces[record.contact_force_steps == 60].sum(0)
    np.testing.assert_allclose(np.abs(last), [0, 0, 0.1 * 0.08 * 0.06 * 1000 * 9.81], rtol=1e-5, atol=1e-4)
    assert record.contact_steps.tolist() == list(range(0, 120, 2)) and set(record.steps) <= set(record.contact_steps)
    assert record.points.shape == (len(record.steps), 3) and record.bodies.max() == 1
    # More steps than the scene's duration.
    simulation.step(10)
    assert simulation.steps == 130 and repr(simulation) == "<tesdf.Simulation: 2 bodies, step 130 of 120>"


def test_what_a_run_does_not_do_is_told(scene, tmp_path):
    simulation = tesdf.Simulation(scene)
    assert simulation.run()["warnings"] == [] and simulation.warnings == []
    # The lower side of the ceiling is 50 mm above the floor, too low for the box.
    low = tmp_path / "low.toml"
    ceiling = "shape = { box = { half_extents = [0.1, 0.1, 0.02] } }\nfixed = true\ntranslation = [0, 0, 0.07]\n"
    low.write_text(SCENE + "[[bodies]]\nname = 'ceiling'\n" + ceiling)
    simulation = tesdf.Simulation(low)
    told = simulation.run()["warnings"]
    overlap = told[0]
    assert overlap["kind"] == "overlap" and overlap["value"] > 4e-3 and "box" in overlap["names"]
    assert simulation.warnings == [warning["message"] for warning in told] and "at the end" in overlap["message"]
    assert overlap["time"] == pytest.approx(simulation.time) and simulation.record().warnings == told
    # The page has them from the simulation and from its file.
    simulation.save(tmp_path / "run.tesrun")
    for name, run in [("simulation", simulation), ("file", tmp_path / "run.tesrun")]:
        tesdf.view(run, tmp_path / f"{name}.html", contacts=0)
        assert json.dumps(overlap["message"]) in (tmp_path / f"{name}.html").read_text()


def test_options(scene):
    simulation = tesdf.Simulation(scene, mode="off", time_step=2e-3, duration=0.01)
    assert simulation.planned_steps == 5 and not simulation.run()["passed"] is None
    seen = []
    tesdf.Simulation(scene).run(progress=lambda done, planned: seen.append((done, planned)))
    assert seen[-1] == (120, 120) and seen == sorted(seen)


def test_errors(scene, tmp_path):
    with pytest.raises(FileNotFoundError, match="none.toml"):
        tesdf.Simulation(tmp_path / "none.toml")
    with pytest.raises(ValueError, match="mode: 'nodes'; expected 'node', 'face', 'exact' or 'off'"):
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


SLIDER = {
    "time_step": 1e-3,
    "duration": 0.1,
    "gravity": [0, 0, 0],
    "bodies": [
        {"name": "rail", "shape": {"box": {"half_extents": [0.1, 0.01, 0.01]}}, "kinematic": True},
        {"name": "car", "shape": {"sphere": {"radius": 0.01}}, "mass": 2.0, "translation": np.array([0, 0, 0.05])},
        {"name": "ball", "shape": {"sphere": {"radius": 0.01}}, "mass": 0.5, "translation": np.array([0, 0, 1])},
    ],
    "joints": [{"name": "slide", "kind": "slider", "parent": "rail", "child": "car", "axis": [1, 0, 0]}],
}


def test_a_scene_of_a_dict_is_that_of_the_file(tmp_path):
    with open(tmp_path / "scene.toml", "w") as file:
        file.write(SCENE)
    toml = {
        "time_step": 1e-3,
        "duration": 0.12,
        "bodies": [
            {"name": "floor", "shape": "plane", "fixed": True},
            {
                "name": "box",
                "shape": {"box": {"half_extents": np.array([0.05, 0.04, 0.03])}},
                "density": 1000,
                "translation": (0, 0, np.float64(0.035)),
            },
        ],
        "record": {"contacts_every": 2},
        "criterion": {"rest": {"after": 0.1, "max_drift": 1e-4, "max_energy_gain": 1e-6}},
    }
    one, other = tesdf.Simulation(toml), tesdf.Simulation(tmp_path / "scene.toml")
    assert one.run()["passed"] and other.run()["passed"]
    assert np.array_equal(one.record().poses, other.record().poses)


def test_forces_are_the_weight_and_what_motors_do():
    scene = {
        "time_step": 5e-3,
        "duration": 1,
        "bodies": [
            {"name": "floor", "shape": "plane", "fixed": True},
            {"name": "ball", "shape": {"sphere": {"radius": 0.02}}, "mass": 0.1, "translation": [0, 0, 0.02]},
            {
                "name": "rod",
                "shape": {"box": {"half_extents": [0.1, 0.01, 0.01]}},
                "mass": 2,
                "translation": [0.1, 0, 1],
            },
        ],
        "joints": [
            {
                "name": "axle",
                "kind": "hinge",
                "child": "rod",
                "anchor": [0, 0, 1],
                "axis": [0, 1, 0],
                "motor": {"limit": 100, "drive": {"velocity": -15}},
            }
        ],
    }
    simulation = tesdf.Simulation(scene)
    simulation.run()
    contacts, joints = simulation.contact_forces, simulation.joint_forces
    assert len(contacts) == 1 and set(contacts.bodies[0]) == {0, 1}
    assert contacts.on(1) == pytest.approx([0, 0, 0.1 * 9.81], rel=1e-6, abs=1e-9)
    assert contacts.on(0) == pytest.approx([0, 0, -0.1 * 9.81], rel=1e-6, abs=1e-9)
    assert contacts.forces.shape == (1, 3) and contacts.points[0] == pytest.approx([0, 0, 0], abs=1e-6)
    assert simulation.coordinates[0] == pytest.approx(-15, rel=1e-2)
    assert simulation.coordinate_rates[0] == pytest.approx(-15, rel=1e-2)
    angle = -simulation.coordinates[0] - 15 * 2.5e-3
    assert joints.motors[0] == pytest.approx(-2 * 9.81 * 0.1 * np.cos(angle), abs=0.1)
    assert np.linalg.norm(joints.forces[0]) == pytest.approx(2 * 0.1 * 15**2, abs=25)


def test_coupled_joints_follow_and_tell_their_force():
    finger = {"shape": tesdf.Box((0.01, 0.01, 0.02)), "mass": 0.1}
    scene = {
        "time_step": 2e-3,
        "duration": 1,
        "gravity": [0, 0, 0],
        "bodies": [
            {"name": "left", **finger, "translation": [0, 0.1, 0]},
            {"name": "right", **finger, "translation": [0, -0.1, 0]},
        ],
        "joints": [
            {"name": "left", "kind": "slider", "child": "left", "axis": [0, 1, 0]},
            {"name": "right", "kind": "slider", "child": "right", "axis": [0, 1, 0]},
        ],
        "couplings": [{"joint": "right", "of": "left", "ratio": -2}],
        "record": {"forces_every": 1},
    }
    simulation = tesdf.Simulation(scene)
    simulation.set_wrench("left", force=[0, -0.5, 0])
    simulation.step(100)
    # 0.1 kg, and four times that of the other finger.
    acceleration = -0.5 / (0.1 + 4 * 0.1)
    left, right = simulation.coordinates
    assert left == pytest.approx(0.5 * acceleration * 0.2 * 0.202, rel=1e-9)
    assert right == pytest.approx(-2 * left, abs=1e-9)
    forces = simulation.joint_forces
    assert forces.couplings == pytest.approx([0.4 * -acceleration, 0.2 * -acceleration], rel=1e-9)
    assert forces.forces[1] == pytest.approx([0, forces.couplings[1], 0], abs=1e-12)
    assert simulation.record().joint_forces.couplings[-2:] == pytest.approx(forces.couplings, rel=1e-6)
    scene["couplings"][0]["of"] = "middle"
    with pytest.raises(tesdf.SceneError, match="couplings: number 1: there is no joint middle"):
        tesdf.Simulation(scene)


def test_motors_wrenches_and_states_are_set_between_steps():
    simulation = tesdf.Simulation(SLIDER)
    assert simulation.joints == ["slide"] and simulation.coordinates.tolist() == [0]
    simulation.set_motor("slide", velocity=0.5)
    simulation.step(10)
    assert simulation.coordinates[0] == pytest.approx(0.005) and simulation.velocities[1, 0] == pytest.approx(0.5)
    # 3 N on 2 kg for 10 ms.
    simulation.set_motor(0, force=3.0)
    simulation.step(10)
    assert simulation.velocities[1, 0] == pytest.approx(0.515)
    simulation.set_motor("slide")
    simulation.step(10)
    assert simulation.velocities[1, 0] == pytest.approx(0.515)
    simulation.set_motor("slide", position=0.02, limit=1e4)
    simulation.step(2)
    assert simulation.coordinates[0] == pytest.approx(0.02)
    simulation.set_motor("slide", spring=(0.02, 1e3, 1e2))
    simulation.step(500)
    assert simulation.coordinates[0] == pytest.approx(0.02, abs=1e-6)
    simulation.set_wrench("ball", force=[1, 0, 0], torque=[0, 0, 1e-3])
    simulation.step(100)
    spin = 1e-3 * 0.1 / (0.4 * 0.5 * 0.01**2)
    assert simulation.velocities[2] == pytest.approx([0.2, 0, 0, 0, 0, spin], abs=1e-9)
    simulation.set_wrench(2)
    simulation.set_state("ball", pose=[1, 2, 3, 0, 0, 0, 1])
    simulation.set_state("rail", velocity=[0, 1, 0, 0, 0, 0])
    simulation.step(10)
    assert simulation.poses[2] == pytest.approx([1.002, 2, 3, 0, 0, *simulation.poses[2, 5:]])
    # The car follows its rail.
    assert simulation.poses[0, 1] == pytest.approx(0.01) and simulation.poses[1, 1] == pytest.approx(0.01, abs=1e-6)


def test_errors_of_what_is_set():
    simulation = tesdf.Simulation(SLIDER)
    with pytest.raises(ValueError, match="joint: 'slid'; expected a number from 0 to 0, or one of slide"):
        simulation.set_motor("slid", velocity=1.0)
    with pytest.raises(ValueError, match="body: 3; expected a number from 0 to 2, or one of rail, car, ball"):
        simulation.set_wrench(3)
    with pytest.raises(ValueError, match="joint: several drives; expected one of velocity, position, force and spring"):
        simulation.set_motor("slide", velocity=1.0, force=1.0)
    with pytest.raises(tesdf.SimulationError, match="joint slide: "):
        simulation.set_motor("slide", velocity=1.0, limit=-1.0)
    with pytest.raises(tesdf.SimulationError, match=r"body 2 \(ball\)"):
        simulation.set_wrench("ball", force=[np.nan, 0, 0])
    with pytest.raises(tesdf.CollideError, match="pose: "):
        simulation.set_state("ball", pose=[0, 0, 0, 0, 0, 0, 2])
    with pytest.raises(tesdf.SceneError, match="bodies: entry 1: unknown field `masss`"):
        tesdf.Simulation({**SLIDER, "bodies": [SLIDER["bodies"][0], {"name": "x", "masss": 1}]})
    with pytest.raises(tesdf.SceneError, match="<scene>, body ball: "):
        tesdf.Simulation({**SLIDER, "joints": [], "bodies": [{**SLIDER["bodies"][2], "mass": -1.0}]})
    with pytest.raises(tesdf.SceneError, match="bodies: missing; expected a list of bodies"):
        tesdf.Simulation({"time_step": 1e-3})
    with pytest.raises(TypeError, match="scene: a value of type object"):
        tesdf.Simulation({"bodies": object()})
    with pytest.raises(TypeError, match="scene: int; expected a path, or a dict"):
        tesdf.Simulation(3)


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


def test_a_notebook_plays_a_run_or_says_what_to_call(scene, tmp_path, monkeypatch):
    simulation = tesdf.Simulation(scene)
    simulation.run()
    shown = simulation._repr_html_()
    source = re.fullmatch(r'<iframe srcdoc="([^"]*)" sandbox="allow-scripts" [^<>]*></iframe>', shown).group(1)
    # The steps whose contacts are recorded.
    tesdf.view(simulation, tmp_path / "page.html", every=2, title="simulation")
    assert html.unescape(source) == (tmp_path / "page.html").read_text(encoding="utf-8")
    monkeypatch.setattr(tesdf.playback, "_NOTEBOOK_BYTES", 1000)
    assert "tesdf.view(simulation" in simulation._repr_html_() and len(simulation._repr_html_()) < 300
    assert "<code>view()</code>" in tesdf.Simulation(scene, history=False)._repr_html_()


def test_a_notebook_plays_a_record(scene, tmp_path, monkeypatch):
    simulation = tesdf.Simulation(scene)
    simulation.run()
    record = simulation.record()
    simulation.reset()
    shown = record._repr_html_()
    source = re.fullmatch(r'<iframe srcdoc="([^"]*)" sandbox="allow-scripts" [^<>]*></iframe>', shown).group(1)
    tesdf.view(record, tmp_path / "page.html", every=2, title="record")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert html.unescape(source) == page
    # It plays the run from which the record is.
    simulation.run()
    tesdf.view(simulation, tmp_path / "again.html", every=2, title="record")
    assert page == (tmp_path / "again.html").read_text(encoding="utf-8")
    monkeypatch.setattr(tesdf.playback, "_NOTEBOOK_BYTES", 1000)
    assert "tesdf.view(record" in record._repr_html_() and len(record._repr_html_()) < 300
    # In another process there are only arrays.
    copy = pickle.loads(pickle.dumps(record))
    assert np.array_equal(copy.poses, record.poses) and copy._repr_html_() == f"<p>{html.escape(repr(copy))}</p>"
    with pytest.raises(ValueError, match="run: Record; expected a path, a Simulation, or a Record of this process"):
        tesdf.view(copy, tmp_path / "page.html")


def test_torsional_friction_stops_a_spin():
    ball = {"name": "ball", "shape": {"sphere": {"radius": 0.05}}, "mass": 0.4, "translation": [0, 0, 0.05]}
    floor = {"name": "floor", "shape": "plane", "fixed": True, "friction_torsional": 0.04}
    bodies = [floor, {**ball, "friction_torsional": 0.0025, "angular_velocity": [0, 0, 20]}]
    simulation = tesdf.Simulation({"time_step": 5e-3, "duration": 0.5, "record": {"forces_every": 1}, "bodies": bodies})
    assert np.array_equal(simulation.frictions_torsional, [0.04, 0.0025])
    inertia, limit = 0.4 * 0.4 * 0.05**2, 0.01 * 0.4 * 9.81
    for _ in range(20):
        simulation.step()
    assert simulation.velocities[1, 5] == pytest.approx(20 - limit / inertia * 0.1, rel=1e-3)
    forces = simulation.contact_forces
    assert np.abs(forces.torques).sum() == pytest.approx(limit, rel=1e-6)
    assert len(simulation.record().contact_forces.torques) >= 20
    simulation.set_friction_torsional("floor", 0)
    before = simulation.velocities[1, 5]
    simulation.step()
    assert simulation.velocities[1, 5] == pytest.approx(before, rel=1e-9)
    with pytest.raises(tesdf.SimulationError, match="friction_torsional"):
        simulation.set_friction_torsional("ball", -1)


def test_a_page_follows_the_steps(scene):
    simulation = tesdf.Simulation(scene)
    view = simulation.view(title="drop")
    assert view == simulation.view() and view.url in view._repr_html_()
    with urllib.request.urlopen(view.url, timeout=60) as page:
        assert "<h1>drop</h1>" in page.read().decode()
    simulation.step()
    with urllib.request.urlopen(view.url + "frames", timeout=60) as frames:
        lines = [frames.readline().decode() for _ in range(2)]
    assert lines[0] == "id: 0\n"
    frame = json.loads(lines[1].removeprefix("data: "))
    assert frame["step"] == 1 and len(frame["poses"]) == 7 * len(simulation.bodies)
    del simulation
    # Refused, or reset where the server ends just then.
    with pytest.raises(OSError):
        for _ in range(100):
            urllib.request.urlopen(view.url, timeout=60).close()
