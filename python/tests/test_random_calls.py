"""Random calls with random arguments: each returns or raises an error for its caller, and bodies stay in finite places.

`RANDOM_CALLS=100000` asks for that many examples, each of up to twelve calls, with a new seed."""

import inspect
import os
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import tesdf
from conftest import DATA, TETRAHEDRON
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from hypothesis.configuration import set_hypothesis_home_dir
from tesdf import _native

EXAMPLES = int(os.environ.get("RANDOM_CALLS", 60))
HOME = tempfile.TemporaryDirectory()
FOLDER = Path(HOME.name)
set_hypothesis_home_dir(FOLDER)

ODD = [0.0, -0.0, 1.0, 1e-9, 1e3, 5e-324, 1e-300, 1e300, -1e300, np.inf, -np.inf, np.nan]
seeds = st.integers(0, 2**32 - 1)
numbers = st.floats(-2, 2) | st.sampled_from(ODD)
integers = st.integers(0, 4) | st.sampled_from([-1, 31, 10000, 2**31, 2**32, 2**64, -(2**63)])
# What few parameters want.
wrong = st.sampled_from([None, True, "", "nothing", b"bytes", [], {}, object(), 1 + 2j, [[1.0], [1.0, 2.0]], np.zeros((2, 2, 2))])


def arrays(*shape, values=ODD):
    """Arrays of this shape, or nearly; None is any length. Of few, one element is one of these values."""

    def of(seed):
        random = np.random.default_rng(seed)
        lengths = [random.integers(4) if n is None else n - (random.random() < 0.02) for n in shape]
        array = random.uniform(-2, 2, lengths)
        if random.random() < 0.1 and array.size:
            array.flat[random.integers(array.size)] = random.choice(values)
        return array

    return seeds.map(of)


def identifiers(*shape, below=6):
    """Integers, most of which are ids."""

    def of(seed):
        random = np.random.default_rng(seed)
        array = random.integers(below, size=[random.integers(4) if n is None else n for n in shape])
        if random.random() < 0.1 and array.size:
            array.flat[random.integers(array.size)] = random.choice([-1, 2**32 - 1, 2**32, 2**62])
        return array

    return seeds.map(of)


def rows(array):
    """`array`, or up to three of them."""
    return st.one_of(array, st.lists(array, min_size=1, max_size=3))


@st.composite
def poses(draw):
    """Poses in both forms; few are none."""
    place, quaternion = draw(vectors), draw(arrays(4))
    if draw(st.integers(0, 9)) == 0:
        return np.concatenate([place, quaternion])
    if draw(st.booleans()):
        with np.errstate(all="ignore"):
            return np.concatenate([place, quaternion / np.linalg.norm(quaternion)])
    return np.block([[np.eye(3), place.reshape(-1, 1)[:3]], [np.zeros(3), np.ones(1)]]) if len(place) == 3 else place


vectors, velocities, screws = arrays(3), arrays(6), arrays(8)
ids, pairs = identifiers(None), identifiers(None, 2)
one_id = identifiers().map(int)
lengths = st.floats(1e-3, 1) | numbers


@cache
def assets():
    corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T * [0.3, 0.2, 0.1]
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [triangle for a, b, c, d in sides for triangle in ([a, b, c], [a, c, d])]
    made = []
    for vertices, faces in (TETRAHEDRON, (corners, faces)):
        repaired = tesdf.repair((vertices, faces), orient=True)
        made.append(tesdf.encode((repaired.vertices, repaired.faces), "fast"))
    return made


@st.composite
def solids(draw):
    """A mesh of a few triangles, with whatever defects they have."""
    vertices = draw(st.just(TETRAHEDRON[0]) | arrays(4, 3))
    faces = draw(st.just(TETRAHEDRON[1]) | identifiers(None, 3, below=4))
    return vertices, faces


shapes = st.one_of(
    st.sampled_from(range(2)).map(lambda k: assets()[k]),
    st.just(tesdf.Plane()),
    st.builds(tesdf.Box, st.tuples(lengths, lengths, lengths)),
    st.builds(tesdf.Sphere, lengths),
    st.builds(tesdf.Capsule, lengths, lengths),
    st.builds(tesdf.Cylinder, lengths, lengths),
)
meshes = st.one_of(solids(), st.sampled_from(range(2)).map(lambda k: assets()[k]), st.sampled_from(["", "no/such.stl", "/"]))
files = st.sampled_from([FOLDER / "a", FOLDER / "a.glb", FOLDER / "a.tesdf", FOLDER / "a.json", FOLDER, "", "no/such/folder/a", "\0"])

SCENE = {
    "time_step": 5e-3,
    "duration": 0.1,
    "bodies": [
        {"name": "floor", "shape": "plane", "fixed": True, "friction": 0.5},
        {"name": "box", "shape": {"box": {"half_extents": [0.05, 0.05, 0.05]}}, "mass": 1.0, "translation": [0, 0, 0.06]},
        {"name": "rod", "shape": {"cylinder": {"half_height": 0.1, "radius": 0.02}}, "mass": 0.2, "translation": [0.3, 0, 0.2]},
        {"name": "door", "shape": {"box": {"half_extents": [0.2, 0.02, 0.3]}}, "mass": 2.0, "translation": [1.2, 0, 1]},
    ],
    "joints": [{"name": "hinge", "kind": "hinge", "child": "door", "anchor": [1, 0, 1], "motor": {"limit": 5, "drive": {"velocity": 3}}}],
}


@st.composite
def scenes(draw):
    """The scene, in which up to two values are other ones."""
    scene = {**SCENE, "bodies": [dict(body) for body in SCENE["bodies"]], "joints": [dict(joint) for joint in SCENE["joints"]]}
    holders = [scene, *scene["bodies"], *scene["joints"]]
    for _ in range(draw(st.integers(0, 2))):
        holder = draw(st.sampled_from(holders))
        key = draw(st.sampled_from(sorted(holder)))
        # Long runs are no errors, and take long.
        if key not in ("time_step", "duration"):
            holder[key] = draw(st.one_of(wrong, numbers, vectors.map(list), st.sampled_from(["box", "floor", "plane", "ball", "hinge"])))
    return scene


# What parameters want, by their names. Devices are those of test_device.py.
PARAMETERS = {
    "a b shape part index": one_id,
    "world memberships filter": one_id | integers,
    "ids moved worlds vertices": ids,
    "pairs": pairs,
    "pose pose_a pose_b transform": poses() | st.none(),
    "poses": rows(poses()),
    "velocity velocity_a velocity_b": velocities | st.none(),
    "velocities velocities_a velocities_b": rows(velocities),
    "screw_a screw_b": screws | st.none(),
    "screws_a screws_b": rows(screws),
    "points origins directions positions normals": rows(vectors),
    "force torque center_of_mass": rows(vectors),
    "gravity spring": rows(vectors),
    "inertia": rows(velocities),
    "q q0 q1": rows(arrays(6)),
    "counts corners": ids,
    "band contact_distance cos_theta speculative_time thickness tolerance weld_tolerance": numbers,
    "bound coefficient duration end limit link margin mass scale": numbers,
    "angle position": numbers,
    "time_step": st.floats(1e-3, 0.1) | numbers,
    "threshold": lengths | st.sampled_from(["safe", "squared:1e-6", "squared:x"]),
    "threads e_max fill_holes reduce spread": integers,
    "resolution": st.sampled_from([0, 1, 2, 8, -1, 2**32]),
    "iterations": st.sampled_from([0, 1, 8, 100, -1]),
    "samples steps": st.sampled_from([0, 1, 100, -1, -(2**63)]),
    "count": st.sampled_from([0, 1, 2, 5, -1, -(2**63), 2**64]),
    "regions": arrays(None, 6),
    "body joint": st.sampled_from(["floor", "box", "rod", "door", "hinge", "none"]) | integers,
    "name": st.sampled_from(["door", "part", ""]),
    "precision": st.sampled_from(["f64", "f32"]),
    "mode": st.sampled_from(["node", "face", "exact", "off"]),
    "contacts_per": st.sampled_from(["cell", "face", "minimum"]),
    "domain": st.sampled_from(["bisection", "no/such.msh"]),
    "encoder": st.sampled_from(["certified", "sampled"]),
    "preset": st.sampled_from(["default", "fast", "compact", "gpu", "sampled-safe"]),
    "inside": st.sampled_from(["winding", "nonzero", "odd", "generalized", "sheet"]),
    "surface": st.sampled_from(["all", "boundary"]),
    "repair": st.sampled_from(["auto", "never"]),
    "unit": st.sampled_from(["m", "mm", "parsec"]),
    "deformable plain history orient allowed": st.booleans(),
    "mesh": meshes,
    "path file": files,
    "data": st.binary(max_size=9) | st.just(None).map(lambda _: assets()[0].to_bytes()[: -1]),
    "packages ignore": wrong,
    "progress": st.just(lambda *_: None),
    "device": st.sampled_from(["cpu", "nonsense", -1, 2**32]),
}
PARAMETERS = {name: values for names, values in PARAMETERS.items() for name in names.split()}

FUNCTIONS = [tesdf.encode, tesdf.check, tesdf.repair, tesdf.clearance, tesdf.collide, tesdf.time_of_impact, tesdf.why]
FUNCTIONS += [tesdf.Robot, tesdf.Simulation, tesdf.Worlds]
FUNCTIONS += [tesdf.signed_distance, tesdf.contains, tesdf.closest_point, _native.polygons, _native.contact_frames]
# Pages and devices have tests of their own.
LEFT_OUT = {"view", "detect_on_device"}


def objects(draw):
    """An object of each class."""
    scene = tesdf.Scene()
    for shape in [*assets(), tesdf.Plane(), tesdf.Box((0.1, 0.2, 0.3))]:
        scene.add(scene.add_shape(shape), [*draw(st.tuples(*[st.floats(-1, 1)] * 3)), 0, 0, 0, 1])
    asset, robot = draw(st.sampled_from(assets())), tesdf.Robot(DATA / "robots/peg-arm.urdf")
    made = [asset, scene, robot, tesdf.InstancePairs(), tesdf.PatchTracker(), tesdf.Simulation(SCENE), tesdf.Worlds(SCENE, 2)]
    return {type(one): one for one in made}


def argument(draw, name, function, owner, scene):
    """What a parameter of a function gets. Its owner is an object or None."""
    if draw(st.integers(0, 24)) == 0:
        return draw(wrong)
    if name == "scene":
        return scene if isinstance(owner, (tesdf.InstancePairs, tesdf.PatchTracker)) else draw(scenes())
    if name == "contacts":
        return scene.detect(contact_distance=0.1)
    if name == "snapshot":
        return owner.snapshot()
    if name == "mesh" and function.__name__ in ("encode", "check", "repair"):
        return draw(solids())
    if name == "shape" and function.__name__ in ("add_shape", "add_obstacle") or name in ("a", "b") and owner is None:
        return draw(shapes | meshes)
    return draw(PARAMETERS[name])


def call(draw, function, owner, scene):
    """Calls a function with random arguments. An error must be one for its caller."""
    arguments, keywords = [], {}
    for name, parameter in inspect.signature(function).parameters.items():
        is_optional = parameter.default is not parameter.empty or parameter.kind is parameter.VAR_KEYWORD
        if is_optional and (parameter.kind is parameter.VAR_KEYWORD or draw(st.integers(0, 3))):
            continue
        value = argument(draw, name, function, owner, scene)
        if parameter.kind is parameter.KEYWORD_ONLY or parameter.default is not parameter.empty:
            keywords[name] = value
        else:
            arguments.append(value)
    try:
        return function(*arguments, **keywords)
    except (ValueError, TypeError, IndexError, OSError) as error:
        assert str(error)


@settings(
    max_examples=EXAMPLES,
    deadline=None,
    database=None,
    derandomize="RANDOM_CALLS" not in os.environ,
    suppress_health_check=list(HealthCheck),
    phases=[Phase.generate, Phase.shrink],
)
@given(st.data())
def test_random_calls_return_or_raise_an_error_of_the_package(data):
    draw = data.draw
    made = objects(draw)
    scene = made[tesdf.Scene]
    for _ in range(draw(st.integers(1, 12))):
        kind = draw(st.sampled_from([None, *made]))
        if kind is None:
            call(draw, draw(st.sampled_from(FUNCTIONS)), None, scene)
            continue
        name = draw(st.sampled_from([name for name in dir(kind) if not name.startswith("_") and name not in LEFT_OUT]))
        member = getattr(made[kind], name)
        result = call(draw, member, made[kind], scene) if callable(member) else None
        if isinstance(result, kind):
            made[kind] = result
        if kind in (tesdf.Simulation, tesdf.Worlds):
            assert np.isfinite(made[kind].poses).all()
            assert np.isfinite(made[kind].velocities).all()
