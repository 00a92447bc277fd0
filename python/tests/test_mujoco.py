"""Contacts in MuJoCo: which bodies meet, what its solver gets, and what bodies do."""

import dataclasses
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
import tesdf
import tesdf.contacts
import tesdf.mujoco
from conftest import PARTS, SCREW
from tesdf._coupling import kinds_of
from tesdf._mujoco_model import Parameters
from tesdf._native import contact_frames, fill_mujoco_contacts

CUBE = f"""
<mujoco>
  <option timestep="0.002"/>
  <asset><mesh name="cube" file="{PARTS}/cube.obj" scale="5 5 5"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 0.1" friction="0.8"/>
    <geom name="wall" type="box" size="0.01 1 1" pos="-1 0 0"/>
    <body name="cube" pos="0 0 0.05"><freejoint/><geom name="cube" type="mesh" mesh="cube" friction="0.5 0.01 0.001"/></body>
  </worldbody>
</mujoco>"""


def model_of(text):
    model = mujoco.MjModel.from_xml_string(text)
    return model, mujoco.MjData(model)


@pytest.fixture(scope="module")
def cube():
    return tesdf.encode(PARTS / "cube.obj", "fast")


def test_the_nut_turns_down_the_bolt(screw):
    model, data = model_of(SCREW)
    contacts = tesdf.mujoco.Contacts(model, screw)
    mujoco.mj_forward(model, data)
    nut = model.body("nut").id
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.body_iquat[nut])
    inertia = axes.reshape(3, 3)[2] ** 2 @ model.body_inertia[nut]
    # Travel of an ideal screw of 2 mm pitch.
    ideal = 9.81 / (1 + inertia / model.body_mass[nut] * (2 * np.pi / 2e-3) ** 2) * 0.2**2 / 2
    start, turned = data.xpos[nut, 2], 0.0
    while data.time < 0.2 - 1e-9:
        contacts.step(model, data)
        turned += data.qvel[5] * model.opt.timestep / (2 * np.pi)
    travel = start - data.xpos[nut, 2]
    assert len(contacts.last) > 1000 and 0.9 < travel / ideal < 1.4
    # Up to the play of the thread.
    assert turned > 0.08 and abs(travel - turned * 2e-3) < 1.2e-4, (travel, turned)
    assert contacts.scene.clearance(0, 1).distance > -1e-6
    # Without contacts it falls.
    while data.time < 0.22:
        mujoco.mj_step(model, data)
    assert data.qvel[2] < -0.15


def test_geoms_are_where_mujoco_has_them():
    """The compiler moves and turns a mesh; its vertices are back in the coordinates of the file."""
    model, data = model_of(f"""
    <mujoco>
      <asset><mesh name="part" file="{PARTS}/l_bracket.obj" scale="2 2 2"/></asset>
      <worldbody>
        <body pos="0.3 -0.1 0.2" euler="20 30 40"><freejoint/><geom name="part" type="mesh" mesh="part" pos="0.1 0 0" euler="5 6 7"/></body>
        <geom name="ball" type="sphere" size="0.1"/>
      </worldbody>
    </mujoco>""")
    asset = tesdf.encode(PARTS / "l_bracket.obj", "fast")
    contacts = tesdf.mujoco.Contacts(model, {"part": asset, "ball": None})
    data.qvel[:] = [1, 2, 3, 4, 5, 6]
    mujoco.mj_forward(model, data)
    contacts.detect(model, data)
    instances = contacts.scene.instances
    x, y, z, w = instances.poses[0, 3:]
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, np.array([w, x, y, z]))
    of_file = 2 * asset.vertices @ rotation.reshape(3, 3).T + instances.poses[0, :3]
    geom = model.geom("part").id
    of_model = model.mesh_vert @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    # The compiler keeps f32, and orders vertices in its own way.
    assert len(of_model) == len(of_file)
    apart = np.linalg.norm(of_file[:, None] - of_model[None], axis=2)
    assert apart.min(axis=0).max() < 1e-6 and apart.min(axis=1).max() < 1e-6
    # The velocity of the origin of the file, from a small step.
    before, h = instances.poses[0, :3].copy(), 1e-6
    mujoco.mj_integratePos(model, data.qpos, data.qvel, h)
    mujoco.mj_forward(model, data)
    falling = model.opt.gravity * model.opt.timestep
    contacts.detect(model, data)
    moved = (contacts.scene.instances.poses[0, :3] - before) / h
    assert np.allclose(moved + falling, instances.velocities[0, :3], atol=1e-4)
    assert np.allclose(contacts.scene.instances.poses[1], [0, 0, 0, 0, 0, 0, 1])


def test_the_solver_gets_the_contacts_of_the_scene(screw):
    model, data = model_of(SCREW)
    contacts = tesdf.mujoco.Contacts(model, screw, contact_distance=3e-4)
    mujoco.mj_step1(model, data)
    count = contacts.add(model, data)
    found, given = contacts.last, data.contact
    assert count == len(found) == data.ncon > 1000
    again = contacts.scene.detect(mode="node", contact_distance=3e-4, speculative_time=1.2 * 0.002)
    for name, array in found.arrays().items():
        assert (array == getattr(again, name)).all(), name
    geoms = np.array([model.geom("bolt").id, model.geom("nut").id])
    assert (given.dist == found.distance).all()
    assert (given.geom1 == geoms[found.instance_b]).all() and (given.geom2 == geoms[found.instance_a]).all()
    frames = given.frame.reshape(-1, 3, 3)
    # From the first geom to the second one, in a right-handed frame.
    assert (frames[:, 0] == found.normal).all()
    assert np.allclose(frames @ frames.transpose(0, 2, 1), np.eye(3), atol=1e-12)
    assert np.allclose(np.linalg.det(frames), 1)
    assert np.allclose(given.pos, (found.point_a + found.point_b) / 2, atol=0)
    assert (given.dim == 1).all() and (given.exclude == 0).all()
    mujoco.mj_makeConstraint(model, data)
    assert data.nefc == count and (data.contact.efc_address == np.arange(count)).all()


def test_a_cube_rests_on_a_plane(cube):
    model, data = model_of(CUBE)
    contacts = tesdf.mujoco.Contacts(model, {"cube": cube, "floor": None, "wall": None})
    mujoco.mj_step1(model, data)
    assert contacts.add(model, data) == 4 and data.ncon == 4
    assert np.allclose(data.contact.friction, [0.8, 0.8, 0.01, 0.001, 0.001])
    while data.time < 0.5:
        contacts.step(model, data)
    assert np.allclose(data.qpos, [0, 0, 0.05, 1, 0, 0, 0], atol=1e-6)
    # Nothing else finds contacts of it.
    while data.time < 0.6:
        mujoco.mj_step(model, data)
    assert data.qpos[2] < 0.03


def test_a_push_is_held_up_to_the_limit_of_friction(cube):
    model, data = model_of(CUBE.replace('"0.8"', '"0.5"'))
    weight = model.body_mass[model.body("cube").id] * 9.81
    for share, moves in [(0.4, False), (0.6, True)]:
        mujoco.mj_resetData(model, data)
        contacts = tesdf.mujoco.Contacts(model, {"cube": cube, "floor": None})
        while data.time < 0.2:
            data.xfrc_applied[1, 0] = share * weight
            contacts.step(model, data)
        assert (data.qpos[0] > 1e-3) == moves, data.qpos


def test_gears_on_hinges_through_their_centres_turn_each_other():
    # MuJoCo gives such bodies an inverse mass of zero, and contacts that are far too stiff.
    gear = tesdf.encode(PARTS / "spur_gear_m2_z20.obj", "fast")
    model, data = model_of(
        f"""
<mujoco>
  <option timestep="0.001" gravity="0 0 0" integrator="implicitfast" cone="elliptic"/>
  <asset><mesh name="gear" file="{PARTS}/spur_gear_m2_z20.obj"/></asset>
  <default><geom type="mesh" mesh="gear" density="7850" condim="1"/></default>
  <worldbody>
    <body><joint name="driver" axis="0 0 1"/><geom name="driver"/></body>
    <body pos="0.04 0 0" euler="0 0 9"><joint axis="0 0 1"/><geom name="driven"/></body>
  </worldbody>
  <actuator><motor joint="driver"/></actuator>
</mujoco>"""
    )
    before = model.body_invweight0[1, 0]
    contacts = tesdf.mujoco.Contacts(model, {"driver": gear, "driven": gear})
    assert before < 1e-9 < 1 < model.body_invweight0[1, 0]
    data.ctrl[0] = 2e-3
    for _ in range(100):
        contacts.step(model, data)
    # The gears share the torque. Some of it is lost at the borders of facets.
    ideal = 0.5 * 2e-3 / (2 * model.body_inertia[1, 2]) * 0.1**2
    assert 0.5 < data.qpos[0] / ideal < 1.05
    # Up to the play of 0.1 mm at a radius of 20 mm.
    assert abs(data.qpos.sum()) < 6e-3
    assert contacts.scene.clearance(0, 1).distance > -1e-6


def test_solref_of_the_model_and_of_the_caller(cube):
    model, data = model_of(CUBE.replace('type="plane"', 'type="plane" solref="0.03 1"'))
    for given, expected in [
        ("model", [0.025, 1]),
        ((-100.0, -3.0), [-100, -3]),
        ("rigid", [-0.9 / 0.002**2, -0.9 / 0.002]),
    ]:
        mujoco.mj_step1(model, data)
        tesdf.mujoco.Contacts(model, {"cube": cube, "floor": None}, solref=given).add(model, data)
        assert np.allclose(data.contact.solref, expected), given


def test_bodies_that_do_not_meet(cube):
    text = """
    <mujoco>
      <asset><mesh name="cube" file="{parts}/cube.obj"/></asset>
      <worldbody>
        <geom name="fixed" type="mesh" mesh="cube"/>
        <geom name="fixed2" type="mesh" mesh="cube" pos="0.01 0 0"/>
        <body name="a"><freejoint/><geom name="a" type="mesh" mesh="cube" pos="0.001 0 0"/>
          <geom name="a2" type="mesh" mesh="cube" pos="0.002 0 0"/>
          <body name="b"><joint type="hinge"/><geom name="b" type="mesh" mesh="cube" pos="0 0.001 0"/>
            <body name="c"><joint type="hinge"/><geom name="c" type="mesh" mesh="cube" pos="0 0.002 0"/></body>
          </body>
        </body>
        <body name="d"><freejoint/><geom name="d" type="mesh" mesh="cube" pos="0 0 0.001"/></body>
        <body name="e"><freejoint/><geom name="e" type="mesh" mesh="cube" pos="0 0 0.002"/></body>
      </worldbody>
      <contact><exclude body1="d" body2="e"/></contact>
    </mujoco>""".format(parts=PARTS)
    model, data = model_of(text)
    names = ["fixed", "fixed2", "a", "a2", "b", "c", "d", "e"]
    # What MuJoCo itself says of these geoms.
    mujoco.mj_forward(model, data)
    pairs = {tuple(sorted(pair)) for pair in data.contact.geom.tolist()}
    assert len(pairs) == 22
    contacts = tesdf.mujoco.Contacts(model, dict.fromkeys(names, cube))
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    found = contacts.detect(model, data)
    ids = np.array([model.geom(name).id for name in names])
    ours = {tuple(sorted(pair)) for pair in np.stack([ids[found.instance_a], ids[found.instance_b]], 1).tolist()}
    assert ours == pairs


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"geoms": {"nut": None, "floor": None}}, "geoms has no asset"),
        ({"geoms": {"screw": "cube"}}, "there is no geom 'screw'; the named ones are ['floor', 'wall', 'cube']"),
        ({"geoms": {"floor": "cube"}}, "geom 'floor' is a plane; an asset needs a mesh geom"),
        ({"geoms": {"cube": "torus"}}, "geom 'cube': its mesh spans"),
        ({"geoms": {"cube": "cube", "wall": None}, "solref": "soft"}, "solref: 'soft'; expected 'rigid', 'model'"),
        ({"geoms": {"cube": "cube"}}, "geom 'cube' meets no other of geoms"),
        ({"geoms": {"cube": "cube", "wall": None}, "solref": (1.0, 2.0, 3.0)}, "expected 'rigid', 'model' or two numbers"),
    ],
)
def test_what_does_not_fit_is_an_error(change, expected, cube, asset):
    model, _ = model_of(CUBE)
    assets = {"cube": cube, "torus": asset}
    geoms = {name: assets.get(value) for name, value in change.pop("geoms").items()}
    with pytest.raises(ValueError) as error:
        tesdf.mujoco.Contacts(model, geoms, **change)
    assert expected in str(error.value)


def test_other_errors(cube, screw):
    model, data = model_of(CUBE)
    contacts = tesdf.mujoco.Contacts(model, {"cube": cube, "floor": None})
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    with pytest.raises(ValueError, match="RK4"):
        contacts.step(model, data)
    model, data = model_of(CUBE.replace('scale="5 5 5"', 'scale="5 5 4"'))
    with pytest.raises(ValueError, match="scale"):
        tesdf.mujoco.Contacts(model, {"cube": cube, "floor": None})
    model, data = model_of(CUBE)
    mujoco.mj_forward(model, data)
    with pytest.raises(ValueError, match="mode: 'corner'"):
        tesdf.mujoco.Contacts(model, {"cube": cube, "floor": None}, mode="corner").detect(model, data)
    model, data = model_of(SCREW.replace('"100M"', '"1M"'))
    contacts = tesdf.mujoco.Contacts(model, screw)
    mujoco.mj_step1(model, data)
    with pytest.raises(ValueError, match="do not fit the model's memory of 1048576 bytes"):
        contacts.add(model, data)
    assert data.ncon == 0


def frames(normals):
    """As `contact_frames`, by numpy: each normal, and two directions that make a right-handed frame with it."""
    x, y, z = np.ascontiguousarray(normals.T)
    is_across = np.abs(x) < 0.7
    found = np.empty((len(normals), 3, 3))
    found[:, 0] = normals
    # The normal and the axis x, or y where the normal is along x.
    other = np.where(is_across, y, x)
    length = np.sqrt(other * other + z * z)
    u = np.where(is_across, 0.0, -z) / length
    v = np.where(is_across, z, 0.0) / length
    w = np.where(is_across, -y, x) / length
    found[:, 1, 0], found[:, 1, 1], found[:, 1, 2] = u, v, w
    found[:, 2, 0], found[:, 2, 1], found[:, 2, 2] = y * w - z * v, z * u - x * w, x * v - y * u
    return found


def fill(contact, start, found, ids, parameters):
    """As `fill_mujoco_contacts`, by numpy, one field after the other."""
    rows = slice(start, start + len(found))
    first, second = found.instance_b, found.instance_a
    kinds, kind = kinds_of(np.stack([first, second], 1))
    each = parameters(ids[kinds[:, 0]], ids[kinds[:, 1]])
    contact.dist[rows] = found.distance
    contact.pos[rows] = 0.5 * (found.point_a + found.point_b)
    contact.frame[rows] = frames(found.normal).reshape(-1, 9)
    contact.dim[rows] = each.condim[kind]
    for name in ("friction", "solref", "solimp"):
        getattr(contact, name)[rows] = getattr(each, name)[kind]
    contact.geom1[rows] = ids[first]
    contact.geom2[rows] = ids[second]
    contact.geom[rows] = np.stack([ids[first], ids[second]], 1)
    for name in ("flex", "elem", "vert", "efc_address"):
        getattr(contact, name)[rows] = -1
    for name in ("includemargin", "solreffriction", "mu", "H", "exclude", "adhesion", "surfacevel"):
        getattr(contact, name)[rows] = 0


FIELDS = {
    "dist": "f8", "pos": "3f8", "frame": "9f8", "includemargin": "f8", "friction": "5f8", "solref": "2f8",
    "solreffriction": "2f8", "solimp": "5f8", "mu": "f8", "H": "36f8", "dim": "i4", "geom1": "i4", "geom2": "i4",
    "geom": "2i4", "flex": "2i4", "elem": "2i4", "vert": "2i4", "exclude": "i4", "efc_address": "i4",
    "adhesion": "f8", "surfacevel": "3f8",
}  # fmt: skip


class Rows:
    """What `data.contact` is to the filling: arrays by their names. Here they are full of 7."""

    def __init__(self, rows, packed):
        self.memory = np.zeros(rows, np.dtype(list(FIELDS.items()), align=not packed))
        for name in FIELDS:
            self.memory[name] = 7
            setattr(self, name, self.memory[name])


def found_and_parameters(rows):
    """Contacts of five instances in random order, and parameters that differ for each pair of geoms."""
    random = np.random.default_rng(3)
    normals = random.normal(size=(rows, 3))
    normals[:6] = np.vstack([np.eye(3), -np.eye(3)])[:rows]
    integers = lambda high, *shape: random.integers(0, high, (rows, *shape)).astype(np.uint32)  # noqa: E731
    found = tesdf.contacts.ContactRows(
        point_a=random.normal(size=(rows, 3)),
        point_b=random.normal(size=(rows, 3)),
        normal=normals / np.linalg.norm(normals, axis=1)[:, None],
        distance=random.normal(size=rows),
        face_a=integers(9), face_b=integers(9), tet_b=integers(9),
        instance_a=integers(5), instance_b=np.sort(integers(5)),
        feature_a=integers(9), feature_b_kind=integers(3).astype(np.uint8), feature_b=integers(9, 2),
        converged=np.ones(rows, bool),
    )  # fmt: skip

    def parameters(first, second):
        each = (100.0 * first + second)[:, None]
        condim = np.array([1, 3, 4, 6])[(first + second) % 4]
        return Parameters(condim, each + np.arange(5), each + np.arange(2), np.asfortranarray(each - np.arange(5)))

    return found, np.array([11, 4, 0, 8, 5]), parameters


@pytest.mark.parametrize("rows", [0, 1, 500])
def test_rows_are_filled_as_by_numpy(rows):
    found, ids, parameters = found_and_parameters(rows)
    # Without padding, some numbers are not aligned.
    ours, theirs = Rows(rows + 5, packed=True), Rows(rows + 5, packed=True)
    fill_mujoco_contacts(ours, 3, found, ids, parameters)
    fill(theirs, 3, found, ids, parameters)
    assert ours.memory.tobytes() == theirs.memory.tobytes()
    # The rows before and after are as they were.
    assert (ours.memory[:3] == Rows(3, packed=True).memory).all()
    assert (ours.memory[-2:] == Rows(2, packed=True).memory).all()
    # Rows in reverse, with gaps between them and between their numbers.
    wide = {name: np.full([2 * size for size in theirs.memory[name].shape], 7, theirs.memory[name].dtype) for name in FIELDS}
    every_other = (slice(None, None, -2), slice(None, None, 2))
    views = {name: array[every_other[: array.ndim]] for name, array in wide.items()}
    fill_mujoco_contacts(SimpleNamespace(**views), 3, found, ids, parameters)
    for name, array in wide.items():
        assert np.array_equal(views[name], theirs.memory[name]), name
        assert (array[::2] == 7).all() and (array.ndim == 1 or (array[:, 1::2] == 7).all()), name


def test_the_solver_gets_the_same_rows_as_by_numpy(cube, screw):
    for text, geoms in ((SCREW, screw), (CUBE, {"cube": cube, "floor": None, "wall": None})):
        model, data = model_of(text)
        contacts = tesdf.mujoco.Contacts(model, geoms, solref="model")
        mujoco.mj_step1(model, data)
        count = contacts.add(model, data)
        assert count == data.ncon > 0
        ours = {name: getattr(data.contact, name).copy() for name in FIELDS}
        ids = np.array([model.geom(name).id for name in geoms])
        fill(data.contact, 0, contacts.last, ids, lambda a, b: contacts._parameters(model, a, b))
        for name, rows in ours.items():
            assert rows.tobytes() == getattr(data.contact, name).tobytes(), name


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"pos": np.zeros((9, 2))}, r"contact.pos: an array of shape (9, 2); expected a numpy array of float64 of shape (N, 3)"),
        ({"dist": np.zeros((9, 1))}, r"contact.dist: an array of shape (9, 1); expected a numpy array of float64 of shape (N,)"),
        ({"dim": np.zeros(9)}, "contact.dim: an array of float64; expected a numpy array of int32"),
        ({"mu": [0.0] * 9}, "contact.mu: list; expected a numpy array of float64"),
        ({"mu": np.broadcast_to(0.0, 9)}, "contact.mu: an array that cannot be written"),
        ({"mu": np.zeros(7)}, "contact.mu: 7 rows; expected at least 8"),
        ({"ids": np.array([1, 2])}, "; expected instances of the 2 geoms"),
        ({"ids": np.array([1, 2, 3, 4, 2**31])}, "geoms: the id 2147483648; expected ids from 0 to 2^31 - 1"),
        ({"friction of kinds": np.zeros((1, 5))}, "friction: an array of shape (1, 5); expected shape ("),
        ({"condim of kinds": np.zeros(1, int)}, "condim: an array of shape (1,); expected shape ("),
        ({"found": np.zeros(4)}, "contacts: arrays of different lengths"),
    ],
)
def test_rows_that_do_not_fit_are_an_error_and_nothing_is_written(change, expected):
    found, ids, parameters = found_and_parameters(5)
    fields = Rows(9, packed=True)
    before = fields.memory.copy()
    [(name, array)] = change.items()
    of_kinds = {name.removesuffix(" of kinds"): array} if name.endswith("kinds") else {}
    if name in FIELDS:
        setattr(fields, name, array)
    if name == "found":
        found = dataclasses.replace(found, distance=array)
    with pytest.raises(ValueError) as error:
        fill_mujoco_contacts(
            fields, 3, found, array if name == "ids" else ids, lambda a, b: dataclasses.replace(parameters(a, b), **of_kinds)
        )
    assert expected in str(error.value)
    assert fields.memory.tobytes() == before.tobytes()


def test_fields_live_until_they_are_written():
    found, ids, parameters = found_and_parameters(500)

    class Temporary:
        def __getattr__(self, name):
            return Rows(500, packed=False).memory[name].copy()

    fill_mujoco_contacts(Temporary(), 0, found, ids, parameters)


def test_errors_of_what_is_called_come_through():
    found, ids, _ = found_and_parameters(5)
    with pytest.raises(ZeroDivisionError):
        fill_mujoco_contacts(Rows(9, packed=True), 3, found, ids, lambda a, b: 1 / 0)
    with pytest.raises(AttributeError, match="dist"):
        fill_mujoco_contacts(object(), 0, found, ids, found_and_parameters(5)[2])


def test_kinds_and_frames():
    random = np.random.default_rng(1)
    for rows in (np.zeros((0, 2)), random.integers(0, 5, (300, 3)), np.array([[2**31, 7], [3, 0], [2**31, 7]])):
        expected, places = np.unique(rows.astype(np.int64), axis=0, return_inverse=True)
        kinds, kind = kinds_of(rows)
        assert np.array_equal(kinds, expected) and np.array_equal(kind, places.reshape(-1))
    normals = random.normal(size=(200, 3))
    normals = np.vstack([normals / np.linalg.norm(normals, axis=1)[:, None], np.eye(3), -np.eye(3)])
    found = contact_frames(normals)
    assert found.tobytes() == frames(normals).tobytes()
    assert np.array_equal(found[:, 0], normals)
    assert np.abs(found @ found.transpose(0, 2, 1) - np.eye(3)).max() < 1e-15 * 4 and (np.linalg.det(found) > 0.9).all()
