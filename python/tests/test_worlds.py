"""Simulations that go back and begin again, and many worlds beside single simulations."""

import copy
import time

import numpy as np
import pytest
import tesdf

SCENE = {
    "time_step": 5e-3,
    "duration": 0.5,
    "solver": {"sleep": 0.1},
    "bodies": [
        {"name": "floor", "shape": "plane", "fixed": True, "friction": 0.5},
        {
            "name": "box",
            "shape": {"box": {"half_extents": [0.05, 0.05, 0.05]}},
            "mass": 1.0,
            "friction": 0.5,
            "translation": [0, 0, 0.06],
            "velocity": [0.5, 0, 0],
        },
        {
            "name": "door",
            "shape": {"box": {"half_extents": [0.2, 0.02, 0.3]}},
            "mass": 2.0,
            "translation": [1.2, 0, 1],
        },
    ],
    "joints": [
        {
            "name": "hinge",
            "kind": "hinge",
            "child": "door",
            "anchor": [1, 0, 1],
            "motor": {"limit": 5, "drive": {"velocity": 3}},
        }
    ],
}


def shown(simulation):
    forces = simulation.contact_forces
    return [
        np.array([simulation.time, simulation.steps]),
        simulation.poses,
        simulation.velocities,
        simulation.coordinates,
        simulation.coordinate_rates,
        forces.points,
        forces.normal_forces,
        simulation.contacts.distance,
    ]


def same(a, b):
    return all(x.tobytes() == y.tobytes() for x, y in zip(a, b))


@pytest.mark.parametrize("history", [True, False])
def test_steps_after_a_snapshot_are_made_again(history):
    simulation = tesdf.Simulation(SCENE, history=history)
    # While the box slides, and while it sleeps.
    for steps in (7, 60):
        simulation.step(steps)
        moment, other = simulation.snapshot(), copy.copy(simulation)
        simulation.step(20)
        expected = shown(simulation)
        simulation.set_friction("floor", 0.1)
        simulation.set_mass("door", 3.0, center_of_mass=[0.01, 0, 0], inertia=[0.1, 0.1, 0.1, 0, 0, 0])
        simulation.set_gravity([0, 0, -1.6])
        simulation.set_motor("hinge", velocity=-1.0)
        simulation.step(20)
        assert simulation.masses.tolist() == [np.inf, 1, 3] and simulation.gravity.tolist() == [0, 0, -1.6]
        simulation.restore(moment)
        assert simulation.masses.tolist() == [np.inf, 1, 2] and simulation.frictions.tolist() == [0.5, 0.5, 0]
        simulation.step(20)
        assert same(shown(simulation), expected)
        other.step(20)
        assert same(shown(other), expected)
        if history:
            assert np.array_equal(simulation.record().poses, other.record().poses)
            assert len(simulation.record().times) == simulation.steps + 1


def test_a_reset_begins_again():
    simulation, fresh = tesdf.Simulation(SCENE), tesdf.Simulation(SCENE)
    simulation.step(70)
    simulation.set_motor("hinge")
    simulation.set_wrench("box", force=[1, 0, 0])
    simulation.reset()
    assert (simulation.time, simulation.steps) == (0, 0) and len(simulation.record().times) == 1
    assert simulation.run()["steps"] == 100 and fresh.run()["steps"] == 100
    assert same(shown(simulation), shown(fresh))
    assert np.array_equal(simulation.record().velocities, fresh.record().velocities)
    # From states that were read, bit for bit; masses stay.
    simulation.reset(poses=fresh.poses, velocities=fresh.velocities)
    assert simulation.poses.tobytes() == fresh.poses.tobytes()
    assert np.array_equal(simulation.record().poses[0], fresh.poses)
    simulation.set_mass("box", 4)
    simulation.reset(velocities=np.zeros((3, 6)))
    assert simulation.masses[1] == 4 and not simulation.velocities.any()
    assert simulation.poses[1].tolist() == [0, 0, 0.06, 0, 0, 0, 1]


def test_without_a_history_nothing_is_kept(tmp_path):
    simulation = tesdf.Simulation(SCENE, history=False)
    simulation.step(10)
    assert simulation.steps == 10 and simulation.time == pytest.approx(0.05)
    asks = [
        simulation.record,
        simulation.summary,
        simulation.run,
        lambda: simulation.save(tmp_path / "run.tesrun"),
        lambda: tesdf.view(simulation, tmp_path / "run.html"),
    ]
    for ask in asks:
        with pytest.raises(tesdf.SimulationError, match="keeps no history; make it with history=True"):
            ask()
    assert simulation.steps == 10


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_worlds_are_single_simulations(threads):
    random = np.random.default_rng(1)
    n = 5
    mass, friction = random.uniform(0.5, 2, n), random.uniform(0.1, 0.9, n)
    gravity = np.column_stack([np.zeros((n, 2)), random.uniform(-12, -8, n)])
    speed, push = random.uniform(-5, 5, n), random.uniform(-1, 1, (n, 3))
    pose = np.tile([0.0, 0, 0, 0, 0, 0, 1], (n, 1))
    pose[:, :3] = random.uniform(0.08, 0.1, (n, 3))
    worlds = tesdf.Worlds(SCENE, n, threads=threads)
    assert len(worlds) == n and worlds.bodies == ["floor", "box", "door"] and worlds.joints == ["hinge"]

    def set_up(target, k=slice(None)):
        target.set_mass("box", mass[k])
        target.set_friction(0, friction[k])
        target.set_friction_torsional(0, friction[k] / 10)
        target.set_friction_torsional("box", 0.01)
        target.set_gravity(gravity[k])

    def act(target, k=slice(None)):
        target.set_motor("hinge", velocity=speed[k], limit=4.0)
        target.set_wrench("box", force=push[k])
        target.set_state("box", pose=pose[k])

    set_up(worlds)
    worlds.step(30)
    worlds.reset([1, 3])
    act(worlds)
    worlds.step()
    worlds.step(29)
    singles = []
    for k in range(n):
        single = tesdf.Simulation(SCENE, history=False)
        set_up(single, k)
        single.step(30)
        if k in (1, 3):
            single.reset()
        act(single, k)
        single.step(30)
        singles.append(single)
    assert worlds.steps.tolist() == [60, 30, 60, 30, 60] == [single.steps for single in singles]
    assert worlds.times.tolist() == [single.time for single in singles]
    for name in ("poses", "velocities", "coordinates", "coordinate_rates", "masses", "frictions", "frictions_torsional", "gravity"):
        expected = np.stack([getattr(single, name) for single in singles])
        found = getattr(worlds, name)
        assert found.shape == expected.shape and found.tobytes() == expected.tobytes(), name
    forces = worlds.joint_forces
    for k, single in enumerate(singles):
        assert np.array_equal(forces.forces[k], single.joint_forces.forces)
        assert np.array_equal(forces.torques[k], single.joint_forces.torques)
        assert np.array_equal(forces.motors[k], single.joint_forces.motors)
        assert np.array_equal(forces.couplings[k], single.joint_forces.couplings)
        assert np.array_equal(worlds.contacts(k).distance, single.contacts.distance)
        assert np.array_equal(worlds.contact_forces(k).normal_forces, single.contact_forces.normal_forces)
        for body in range(3):
            assert worlds.net_contact_forces[k, body] == pytest.approx(single.contact_forces.on(body), abs=1e-12)
    assert np.abs(worlds.net_contact_forces[:, 1, 2]).max() > 1


def test_worlds_go_back_and_spread_from_one():
    worlds = tesdf.Worlds(SCENE, 4)
    worlds.set_friction("floor", [0.1, 0.2, 0.3, 0.4])
    worlds.step(20)
    moment, other, two = worlds.snapshot(), worlds.copy(), worlds.snapshot([2])
    assert len(moment) == 4 and len(two) == 1
    worlds.step(10)
    expected = worlds.poses
    assert len({pose.tobytes() for pose in expected}) == 4
    worlds.restore(moment)
    worlds.step(10)
    other.step(10)
    assert worlds.poses.tobytes() == expected.tobytes() == other.poses.tobytes()
    # All worlds go on from the third one.
    worlds.restore(two)
    worlds.step(10)
    assert all(pose.tobytes() == expected[2].tobytes() for pose in worlds.poses)
    done = np.array([True, False, False, True])
    worlds.reset(done, poses=np.tile(worlds.poses[1], (2, 1, 1)))
    assert worlds.steps.tolist() == [0, 30, 30, 0]
    assert worlds.poses[3].tobytes() == worlds.poses[1].tobytes()
    worlds.reset([])
    worlds.reset(2)
    assert worlds.steps.tolist() == [0, 30, 0, 0]


def test_a_mass_does_not_depend_on_the_one_before():
    once, twice = tesdf.Simulation(SCENE), tesdf.Simulation(SCENE)
    for mass in (0.3, 1.7, 0.9):
        twice.set_mass("door", mass, center_of_mass=[0, 0, mass], inertia=[1, 1, 1, 0, 0, 0])
        twice.set_mass("door", mass)
    once.set_mass("door", 0.9)
    for simulation in (once, twice):
        simulation.reset()
        simulation.step(20)
    assert same(shown(once), shown(twice))


def test_a_reset_and_a_step_take_little_time():
    """Far above what they take, 2 and 15 us on a free processor: a thread that is started takes more."""
    simulation = tesdf.Simulation(SCENE, history=False, threads=1)
    simulation.set_gravity([0, 0, 0])
    simulation.set_motor("hinge")

    def fastest(call):
        def once():
            begin = time.perf_counter()
            call()
            return time.perf_counter() - begin

        return min(once() for _ in range(200))

    assert fastest(simulation.reset) < 1e-4
    assert fastest(simulation.step) < 1e-3


def test_what_does_not_fit_is_refused():
    simulation, worlds = tesdf.Simulation(SCENE), tesdf.Worlds(SCENE, 3)
    with pytest.raises(ValueError, match="count: 0; expected a number of worlds, 1 or more"):
        tesdf.Worlds(SCENE, 0)
    with pytest.raises(ValueError, match=r"mass: an array of shape \(2,\); expected a number, or shape \(3,\) with a row"):
        worlds.set_mass("box", [1, 2])
    with pytest.raises(ValueError, match=r"gravity: an array of shape \(3, 2\); expected shape \(3,\) or \(3, 3\)"):
        worlds.set_gravity(np.zeros((3, 2)))
    with pytest.raises(ValueError, match=r"pose: .*shape \(2, 7\); expected shape \(7,\), .*or \(3, …\)"):
        worlds.set_state("box", pose=np.zeros((2, 7)))
    with pytest.raises(ValueError, match="worlds: 3; expected numbers from 0 to 2, or a mask of shape"):
        worlds.reset([3])
    with pytest.raises(ValueError, match="worlds: 1 twice; expected each number once"):
        worlds.reset([1, 1])
    with pytest.raises(ValueError, match=r"worlds: a mask of shape \(2,\); expected numbers from 0 to 2"):
        worlds.reset(np.array([True, False]))
    with pytest.raises(ValueError, match=r"worlds: an array of float64; expected integers"):
        worlds.reset([0.5])
    with pytest.raises(ValueError, match="world: 3; expected a number from 0 to 2"):
        worlds.contacts(3)
    with pytest.raises(ValueError, match=r"poses: .*shape \(2, 7\); expected shape \(3, 7\), a row for each body$"):
        simulation.reset(poses=np.zeros((2, 7)))
    with pytest.raises(tesdf.CollideError, match="poses: body 0: "):
        simulation.reset(poses=np.zeros((3, 7)))
    with pytest.raises(tesdf.SimulationError, match=r"state of body 1 \(box\) is not finite"):
        simulation.reset(velocities=[[0] * 6, [np.nan] * 6, [0] * 6])
    with pytest.raises(tesdf.SimulationError, match=r"^body box: mass -1; expected a finite number greater than 0"):
        simulation.set_mass("box", -1)
    with pytest.raises(tesdf.SimulationError, match=r"world 1: body box: mass 0; expected"):
        worlds.set_mass("box", [1, 0, 1])
    with pytest.raises(tesdf.SimulationError, match=r"body 0 \(floor\) is fixed and has no mass; only a free body has"):
        simulation.set_mass("floor", 1)
    with pytest.raises(tesdf.SimulationError, match="friction is -0.5; expected a finite number, 0 or greater"):
        simulation.set_friction("box", -0.5)
    with pytest.raises(tesdf.SimulationError, match="gravity is NaN; expected finite numbers"):
        simulation.set_gravity([0, 0, np.nan])
    with pytest.raises(ValueError, match="body: 'bax'; expected a number from 0 to 2, or one of floor, box, door"):
        worlds.set_friction("bax", 1)
    with pytest.raises(ValueError, match="joint: several drives; expected one of velocity"):
        worlds.set_motor("hinge", velocity=1, position=[1, 2, 3])
    with pytest.raises(ValueError, match="snapshot: of 2 worlds; expected one of 3 worlds, or of one"):
        worlds.restore(worlds.snapshot([0, 1]))
    with pytest.raises(tesdf.SimulationError, match="the snapshot is of another simulation"):
        simulation.restore(tesdf.Simulation(SCENE).snapshot())
    far = [1e308, 0, 0, 0, 0, 0, 1]
    worlds.set_state("box", pose=far, velocity=[1e308, 0, 0, 0, 0, 0], worlds=[1])
    with pytest.raises(tesdf.SimulationError, match="world 1: step 0: "):
        worlds.step()
    assert worlds.steps.tolist() == [1, 0, 1]


def test_what_is_not_obeyed_is_told_without_a_history():
    box, press = {"half_extents": [0.05, 0.05, 0.05]}, {"half_extents": [0.1, 0.1, 0.02]}
    bodies = [
        {"name": "floor", "shape": "plane", "fixed": True},
        {"name": "box", "shape": {"box": box}, "mass": 1, "translation": [0, 0, 0.05]},
        {"name": "press", "shape": {"box": press}, "kinematic": True, "translation": [0, 0, 0.121], "velocity": [0, 0, -0.1]},
    ]
    scene = {"time_step": 5e-3, "duration": 0.4, "bodies": bodies}
    recorded = tesdf.Simulation(scene)
    recorded.run()
    assert any("overlap by" in line and "box" in line for line in recorded.warnings), recorded.warnings
    simulation = tesdf.Simulation(scene, history=False)
    assert simulation.warnings == []
    simulation.step(80)
    assert simulation.warnings == recorded.warnings
    worlds = tesdf.Worlds(scene, 2)
    worlds.step(80)
    worlds.reset([0])
    assert worlds.warnings(0) == [] and worlds.warnings(1) == recorded.warnings
    assert worlds.unconverged_steps.tolist() == [0, recorded.summary()["unconverged_steps"]]
