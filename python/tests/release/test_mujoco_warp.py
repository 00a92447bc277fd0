"""Contacts in MJWarp: the solver gets the rows of MuJoCo, worlds are apart, too little room is an error."""

import mujoco
import mujoco_warp as mjw
import numpy as np
import pytest
import tesdf
import tesdf.mujoco
import tesdf.mujoco_warp
import warp as wp
from conftest import PARTS, SCREW
from unoptimised_kernels import unoptimised

unoptimised()

# The ball and the floor meet by MJWarp's own contacts.
CUBE = f"""
<mujoco>
  <option timestep="0.002" integrator="implicitfast" cone="elliptic"/>
  <asset><mesh name="cube" file="{PARTS}/cube.obj" scale="5 5 5"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 0.1" friction="0.3"/>
    <body name="cube" pos="0 0 0.05"><freejoint/><geom name="cube" type="mesh" mesh="cube" friction="0.5 0.01 0.001"/></body>
    <body name="ball" pos="0.5 0 0.0199"><joint type="slide" axis="0 0 1"/><geom name="ball" type="sphere" size="0.02"/></body>
  </worldbody>
</mujoco>"""


@pytest.fixture(scope="module")
def cube():
    return tesdf.encode(PARTS / "cube.obj", "fast")


def test_the_nut_turns_down_the_bolt_in_the_world_with_gravity(screw):
    model = mujoco.MjModel.from_xml_string(SCREW)
    contacts = tesdf.mujoco_warp.Contacts(model, screw, nworld=2)
    m = mjw.put_model(model)
    d = mjw.make_data(model, nworld=2, nconmax=6000, njmax=6000)
    m.opt.gravity = wp.array([[0, 0, 0], [0, 0, -9.81]], dtype=wp.vec3)
    nut = model.body("nut").id
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.body_iquat[nut])
    inertia = axes.reshape(3, 3)[2] ** 2 @ model.body_inertia[nut]
    # Travel of an ideal screw of 2 mm pitch.
    ideal = 9.81 / (1 + inertia / model.body_mass[nut] * (2 * np.pi / 2e-3) ** 2) * 0.2**2 / 2
    turned = np.zeros(2)
    for _ in range(100):
        contacts.step(m, d)
        turned += d.qvel.numpy()[:, 5] * 0.002 / (2 * np.pi)
    travel = 0.036 - d.qpos.numpy()[:, 2]
    in_world = contacts.last.instance_a // 2
    assert (np.bincount(in_world) > 1000).all() and (in_world == contacts.last.instance_b // 2).all()
    assert abs(travel[0]) < 1e-7 and abs(turned[0]) < 1e-5
    assert 0.9 < travel[1] / ideal < 1.4
    # Up to the play of the thread.
    assert turned[1] > 0.08 and abs(travel[1] - turned[1] * 2e-3) < 1.2e-4, (travel, turned)
    assert contacts.scene.clearance(2, 3).distance > -1e-6


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
@pytest.mark.parametrize("solref", ["rigid", "model"])
def test_rows_are_those_of_mujoco(cone, solref, cube):
    """A tilted cube: one edge is in the floor, one above. MuJoCo has rows of contacts ahead."""
    model = mujoco.MjModel.from_xml_string(CUBE.replace("elliptic", cone))
    data = mujoco.MjData(model)
    data.qpos[:7] = [0, 0, 0.05, np.cos(0.001), np.sin(0.001), 0, 0]
    data.qvel[:6] = [0.1, 0, -0.2, 0, 0.3, 0]
    options = {"solref": solref, "contact_distance": 2e-3}
    contacts = tesdf.mujoco_warp.Contacts(model, {"cube": cube, "floor": None}, **options)
    m, d = mjw.put_model(model), mjw.put_data(model, data, nconmax=16, njmax=64)
    contacts.step(m, d)
    tesdf.mujoco.Contacts(model, {"cube": cube, "floor": None}, **options).step(model, data)

    count = int(d.nacon.numpy()[0])
    places = d.contact.pos.numpy()[:count]
    assert count == data.ncon == 5
    rows = 3 if cone == "elliptic" else 4
    for i in range(count):
        same = int(np.linalg.norm(places - data.contact.pos[i], axis=1).argmin())
        assert np.allclose(d.contact.dist.numpy()[same], data.contact.dist[i], atol=1e-8)
        of_mujoco = data.contact.efc_address[i] + np.arange(rows)
        ours = d.contact.efc_address.numpy()[same, :rows]
        assert np.allclose(d.efc.aref.numpy()[0, ours], data.efc_aref[of_mujoco], rtol=1e-4, atol=1e-3)
        assert np.allclose(d.efc.D.numpy()[0, ours], data.efc_D[of_mujoco], rtol=1e-4)
        assert np.allclose((d.efc.pos.numpy() - d.efc.margin.numpy())[0, ours[0]], data.contact.dist[i], atol=1e-8)
    assert (data.contact.dist > 1e-5).any() and (data.contact.dist < -1e-5).any()
    assert np.allclose(d.qvel.numpy()[0], data.qvel, atol=1e-4)
    assert np.allclose(d.qpos.numpy()[0], data.qpos, atol=1e-6)


def test_a_push_is_held_in_the_world_with_friction(cube):
    model = mujoco.MjModel.from_xml_string(CUBE)
    contacts = tesdf.mujoco_warp.Contacts(model, {"cube": cube, "floor": None}, nworld=2)
    m, d = mjw.put_model(model), mjw.make_data(model, nworld=2, nconmax=16, njmax=64)
    friction = np.tile(model.geom_friction, (2, 1, 1))
    friction[1, model.geom("cube").id, 0] = 0.3
    m.geom_friction = wp.array(friction, dtype=wp.vec3)
    push = np.zeros((2, model.nbody, 6))
    push[:, model.body("cube").id, 0] = 0.4 * model.body_mass[model.body("cube").id] * 9.81
    d.xfrc_applied.assign(push)
    for _ in range(100):
        contacts.step(m, d)
    moved = d.qpos.numpy()
    assert abs(moved[0, 0]) < 1e-4 and moved[1, 0] > 1e-2
    for world in (0, 1):
        data = mujoco.MjData(model)
        data.xfrc_applied[:] = push[world]
        model.geom_friction[:] = friction[world]
        of_mujoco = tesdf.mujoco.Contacts(model, {"cube": cube, "floor": None})
        for _ in range(100):
            of_mujoco.step(model, data)
        assert np.allclose(moved[world, :7], data.qpos[:7], atol=1e-5)
    # The ball rests by the contact of MJWarp.
    assert np.allclose(moved[:, 7], 0, atol=1e-3)
    assert set(d.contact.geom.numpy()[: int(d.nacon.numpy()[0])].ravel()) == {0, 1, 2}
    # Without contacts the cube falls.
    m.opt.disableflags |= mjw.DisableBit.CONTACT
    before = d.qvel.numpy()[:, 2].copy()
    contacts.step(m, d)
    assert np.allclose(d.qvel.numpy()[:, 2] - before, -9.81 * 0.002, atol=1e-5), before


@pytest.mark.parametrize(
    ("sizes", "sparse", "expected"),
    [
        ({"nconmax": 4}, False, r"5 contacts in 1 worlds, but the data has room for 4; .*naconmax=7"),
        ({"nconmax": 9, "njmax": 8}, False, r"world 0 has 15 constraints, but the data has room for 8; .*njmax=20"),
        ({"nconmax": 9, "njmax": 64, "njmax_nnz": 20}, True, "more than njmax_nnz = 20 numbers .*njmax_nnz=njmax"),
    ],
)
def test_too_little_room_is_an_error(sizes, sparse, expected, cube):
    model = mujoco.MjModel.from_xml_string(CUBE)
    if sparse:
        model.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    contacts = tesdf.mujoco_warp.Contacts(model, {"cube": cube, "floor": None})
    m, d = mjw.put_model(model), mjw.make_data(model, **sizes)
    with pytest.raises(ValueError, match=expected):
        contacts.step(m, d)


def test_what_does_not_fit_is_an_error(cube):
    model = mujoco.MjModel.from_xml_string(CUBE)
    geoms = {"cube": cube, "floor": None}
    early = mjw.put_model(model)
    contacts = tesdf.mujoco_warp.Contacts(model, geoms)
    m, d = mjw.put_model(model), mjw.make_data(model, nconmax=16)
    with pytest.raises(ValueError, match="call put_model after Contacts"):
        contacts.step(early, d)
    with pytest.raises(ValueError, match="the data has 3 worlds, but the contacts 1; give Contacts nworld=3"):
        contacts.step(m, mjw.make_data(model, nworld=3))
    m.opt.integrator = mjw.IntegratorType.RK4
    with pytest.raises(ValueError, match="the integrator is RK4; expected EULER"):
        contacts.step(m, d)
    m.opt.integrator = mjw.IntegratorType.EULER
    m.opt.enableflags |= mjw.EnableBit.SLEEP
    with pytest.raises(ValueError, match="switch sleep off"):
        contacts.step(m, d)
    with pytest.raises(ValueError, match="nworld: 0; expected at least 1"):
        tesdf.mujoco_warp.Contacts(model, geoms, nworld=0)
    with pytest.raises(ValueError, match="there is no geom 'screw'"):
        tesdf.mujoco_warp.Contacts(model, {"screw": cube})
