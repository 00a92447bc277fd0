"""Robots of scenes against MuJoCo, which reads the same files."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
import tesdf

ARM = Path(__file__).parents[2] / "data/robots/peg-arm.urdf"
JOINTS = ["pan", "lift", "elbow", "roll", "bend", "reach"]
START = dict(zip(JOINTS, [0.7, 0.4, -0.9, 2.5, 0.6, 0.03]))
LINKS = ["shoulder", "upper", "fore", "wrist", "hand", "tool", "peg", "camera"]


def scene(time_step, file=ARM, duration=1.0, **robot):
    robot = {"file": file, "fixed": True, "coordinates": START, "self_contacts": False, **robot}
    return {"time_step": time_step, "duration": duration, "bodies": [], "robots": [robot], "detector": {"mode": "off"}}


def in_mujoco(time_step):
    """The model of MuJoCo, in which fixed links are bodies of their own and nothing touches."""
    text = ARM.read_text().replace("<robot name=\"peg-arm\">", "<robot name=\"a\"><mujoco><compiler fusestatic=\"false\"/></mujoco>")
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep, model.opt.integrator = time_step, mujoco.mjtIntegrator.mjINT_RK4
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    for name, q in START.items():
        data.joint(name).qpos[0] = q
    mujoco.mj_forward(model, data)
    return model, data


def assert_same_poses(poses, bodies, data, tolerance):
    for link in LINKS:
        body, found = data.body(link), poses[bodies.index(link)]
        assert found[:3] == pytest.approx(body.xpos, abs=tolerance), link
        quaternion = np.roll(found[3:], 1)
        assert abs(quaternion @ body.xquat) == pytest.approx(1, abs=tolerance**2 + 1e-15), link


def test_links_start_where_mujoco_has_them():
    simulation = tesdf.Simulation(scene(1e-3))
    assert_same_poses(simulation.poses, simulation.bodies, in_mujoco(1e-3)[1], 1e-9)
    coordinates = dict(zip(simulation.joints, simulation.coordinates))
    assert {name: coordinates[name] for name in JOINTS} == pytest.approx(START, abs=1e-12)


def test_the_free_fall_of_an_arm_is_that_of_mujoco():
    model, data = in_mujoco(1e-4)
    for _ in range(2000):
        mujoco.mj_step(model, data)
    expected = np.array([data.joint(name).qpos[0] for name in JOINTS])
    # The joints must have moved for the comparison to mean something.
    assert np.abs(expected - list(START.values())).max() > 0.1

    def error(time_step):
        simulation = tesdf.Simulation(scene(time_step))
        simulation.step(round(0.2 / time_step))
        found = dict(zip(simulation.joints, simulation.coordinates))
        return np.array([found[name] for name in JOINTS]) - expected

    # The error is proportional to the time step, so it goes where that goes.
    coarse, fine = error(2e-3), error(1e-3)
    assert np.abs(fine).max() < 3e-3 and np.abs(2 * fine - coarse).max() < 5e-5, (coarse, fine)


CHAIN = """<mujoco><compiler angle="radian"/><worldbody>
<body name="a" pos="0 0 1" euler="0.3 0.1 0.2">
  <joint name="turn" axis="0 1 0.2" pos="0.02 0 0.05" damping="0.1" armature="0.01"/>
  <geom type="capsule" fromto="0 0 0 0.3 0 0.05" size="0.03"/>
  <geom type="cylinder" size="0.04 0.05" pos="0.3 0 0" euler="0.4 0 0" mass="0.4"/>
  <body name="b" pos="0.35 0 0" euler="0 0.5 0"><joint name="slide" type="slide" axis="1 0 0.3" damping="3"/>
    <geom type="box" size="0.05 0.03 0.02" pos="0.05 0 0" euler="0 0 0.3"/>
    <body name="c" pos="0.1 0 0"><joint name="free"/>
      <inertial pos="0.05 0.01 0" mass="0.3" fullinertia="0.001 0.0012 0.0015 0.0001 0.0002 -0.0001"/>
</body></body></body></worldbody></mujoco>"""


def test_an_mjcf_file_falls_as_in_mujoco(tmp_path):
    file = tmp_path / "chain.xml"
    file.write_text(CHAIN)
    model = mujoco.MjModel.from_xml_string(CHAIN)
    model.opt.timestep, model.opt.integrator = 1e-4, mujoco.mjtIntegrator.mjINT_RK4
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    for _ in range(2000):
        mujoco.mj_step(model, data)

    def error(time_step):
        simulation = tesdf.Simulation(scene(time_step, file, fixed=False, coordinates={}))
        simulation.step(round(0.2 / time_step))
        return simulation.coordinates - [data.joint(name).qpos[0] for name in simulation.joints]

    coarse, fine = error(2e-3), error(1e-3)
    assert np.abs(data.qpos).min() > 0.05 and len(fine) == 3
    assert np.abs(fine).max() < 5e-3 and np.abs(2 * fine - coarse).max() < 1e-5, (coarse, fine)


def test_a_robot_without_a_scene_is_told_what_to_do():
    with pytest.raises(tesdf.SceneError, match=r"a robot description; give it a scene: \[\[robots\]\]"):
        tesdf.Simulation(ARM)
    with pytest.raises(tesdf.SceneError, match="robots: .*the robot has no joint nose that turns or slides"):
        tesdf.Simulation(scene(1e-3, coordinates={"nose": 1.0}))


def test_an_arm_puts_its_peg_into_a_hole():
    scene_file = ARM.parents[2] / "scenes/arm-peg-in-hole.toml"
    summary = tesdf.Simulation(scene_file).run()
    assert summary["passed"] and summary["warnings"] == [], summary
    assert not tesdf.Simulation(scene_file, mode="off").run()["passed"]
