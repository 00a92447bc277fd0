"""tesdf.mujoco_warp with contacts of a CUDA device, on the stand-in for CUDA."""

import mujoco
import mujoco_warp as mjw
import numpy as np
import pytest
import tesdf
import tesdf.mujoco_warp
import warp as wp
from unoptimised_kernels import unoptimised


def test_contacts_for_mjwarp_stay_on_cuda(tmp_path, monkeypatch):
    """Warp's arrays are on the processor here, whose memory is that of the stand-in for CUDA."""
    if not any("CUDA on the CPU" in device.name for device in tesdf.devices()):
        pytest.fail("this test needs the stand-in for CUDA")
    unoptimised()
    tetrahedron = ([0, 0, 0], [1, 0.1, 0], [0, 0.8, 0], [0.2, 0.2, 0.7])
    (tmp_path / "part.obj").write_text("".join("v {} {} {}\n".format(*v) for v in tetrahedron)
                                       + "".join("f {} {} {}\n".format(*f) for f in ([1, 3, 2], [1, 2, 4], [2, 3, 4], [1, 4, 3])))
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <option timestep="0.01"/>
      <asset><mesh name="part" file="{tmp_path}/part.obj" scale="2 2 2"/></asset>
      <worldbody>
        <geom name="floor" type="plane" size="9 9 0.1" friction="0.3" priority="1" condim="4"/>
        <body name="low" pos="0 0 0.02" euler="5 3 40"><freejoint/><geom name="low" type="mesh" mesh="part" solmix="2"/></body>
        <body name="high" pos="0.2 0.1 0.5" euler="70 9 0"><freejoint/><geom name="high" type="mesh" mesh="part" friction="0.7"/></body>
      </worldbody></mujoco>""")
    part = tesdf.encode(tmp_path / "part.obj", "fast")
    found, poses = [], []
    for options in ({}, {"device": "cuda:0"}):
        contacts = tesdf.mujoco_warp.Contacts(model, {"low": part, "floor": None, "high": part}, nworld=2, contact_distance=0.3, **options)
        m = mjw.put_model(model)
        d = mjw.make_data(model, nworld=2, nconmax=64, njmax=256)
        friction = np.tile(model.geom_friction, (2, 1, 1))
        friction[1, model.geom("floor").id, 0] = 0.9
        m.geom_friction = wp.array(friction, dtype=wp.vec3)
        velocities = np.random.default_rng(3).uniform(-1, 1, (2, model.nv))
        d.qvel.assign(velocities)
        mjw.fwd_kinematics(m, d)
        mjw.com_vel(m, d)
        if options:
            monkeypatch.setattr(tesdf.mujoco_warp, "cuda_number", lambda device: 0)
        d.nacon.fill_(1)
        count = contacts.add(m, d)
        assert count == len(contacts.last) > 6 and d.nacon.numpy()[0] == count + 1
        names = ("dist", "pos", "frame", "includemargin", "friction", "solref", "solreffriction", "solimp",
                 "dim", "geom", "flex", "worldid", "type")
        rows = np.hstack([getattr(d.contact, name).numpy()[1 : count + 1].reshape(count, -1).astype(float) for name in names])
        found.append(rows[np.lexsort((rows[:, 3].round(4), rows[:, 2].round(4), rows[:, 1].round(4), rows[:, -2]))])
        assert d.contact.geomcollisionid.numpy()[1 : count + 1].tolist() == list(range(count))
        poses.append(contacts.scene.instances.poses)
    assert type(contacts.last) is tesdf.DeviceContacts
    assert found[0].shape == found[1].shape and set(found[0][:, -2]) == {0, 1}
    assert np.abs(found[0] - found[1]).max() < 2e-5
    # A quaternion and its negative are the same rotation.
    signs = np.sign((poses[0] * poses[1])[:, 3:].sum(axis=1))
    assert np.abs(poses[0][:, 3:] - signs[:, None] * poses[1][:, 3:]).max() < 1e-6
    assert np.abs(poses[0][:, :3] - poses[1][:, :3]).max() < 1e-6
