"""Detection, queries and simulations on devices, against the processor.

wgpu:0 is a graphics card or Vulkan's software driver, cuda:0 an NVIDIA GPU or its stand-in on the
processor, as .ci/python.sh has it. The stand-in's memory is that of the process.
"""

import ctypes
import multiprocessing

import numpy as np
import pytest
import tesdf
from make_reference import sdf  # numpy's brute force over all faces, in data/reference
from test_contacts import LINKED

DEVICES = ["wgpu:0", "cuda:0"]
DIAGONAL = 4.04
# The documented error of distances on a device, as a share of the body's diagonal, and of a point's
# distance from the origin where points are float32.
DISTANCE = 2e-6


@pytest.fixture(params=DEVICES)
def device(request):
    return request.param


@pytest.fixture
def linked(asset):
    scene = tesdf.Scene()
    scene.add_many(scene.add_shape(asset), [[0, 0, 0, 0, 0, 0, 1], LINKED])
    return scene


def error(points, share=DISTANCE):
    return share * np.maximum(DIAGONAL, np.linalg.norm(points, axis=1))


def to_faces(mesh, points, faces):
    """the distance of each point from a face, by brute force"""
    vertices, corners = mesh
    return np.array([abs(sdf(vertices, corners[[face]], [point])[0][0]) for point, face in zip(points, faces)])


def test_devices_have_numbers_and_names(linked):
    devices = tesdf.devices()
    assert [device.number for device in devices] == list(range(len(devices))) and len(devices) >= 2
    assert {type(device) for device in devices} == {tesdf.Device}
    [cuda] = [device for device in devices if device.name.endswith("(cuda:0)")]
    assert cuda.kind == "discrete GPU" and cuda.max_buffer_bytes >= 1 << 27
    least, most = devices[-1].subgroup_size
    assert 0 < least <= most
    with pytest.raises(tesdf.DeviceError, match=r'no device is named "no such"; this machine has 0: .*\(cuda:0\)'):
        linked.detect(device="no such")
    with pytest.raises(ValueError, match='device: float; expected "cpu", "gpu", or the number or name of a device'):
        linked.detect(device=1.5)


def test_names_of_one_device(linked, monkeypatch):
    monkeypatch.setenv("TESDF_DEVICE", "wgpu:0")
    by_name = linked.detect(mode="node", device="wgpu:0")
    [number] = [d.number for d in tesdf.devices() if d.name == tesdf.DeviceArray(np.zeros(1, np.float32)).device]
    for device in ("gpu", number, str(number)):
        assert np.array_equal(linked.detect(mode="node", device=device).distance, by_name.distance)
    for device in (None, "cpu"):
        assert np.array_equal(linked.detect(mode="node", device=device).distance, linked.detect(mode="node").distance)


def test_contacts_at_nodes_are_those_of_the_processor(linked, device):
    reach = 0.03
    expected = linked.detect(mode="node", contact_distance=reach)
    found = linked.detect(mode="node", contact_distance=reach, device=device)
    bound = DISTANCE * DIAGONAL
    keys = [list(zip(c.instance_a.tolist(), c.instance_b.tolist(), c.feature_a.tolist())) for c in (expected, found)]
    surely = [{key for key, d in zip(of, c.distance) if d < reach - bound} for of, c in zip(keys, (expected, found))]
    assert surely[0] <= set(keys[1]) and surely[1] <= set(keys[0]) and len(surely[0]) > 20
    rows = {key: row for row, key in enumerate(keys[0])}
    both = np.array([(rows[key], row) for row, key in enumerate(keys[1]) if key in rows])
    for name, tolerance in (("distance", bound), ("point_a", bound), ("point_b", 1e-3), ("normal", 1e-3)):
        a, b = getattr(expected, name)[both[:, 0]], getattr(found, name)[both[:, 1]]
        assert np.abs(a - b).max() <= tolerance, name
    # Of each contact, the distance is that of the field.
    of_field = found.instance_b == 0
    points = found.point_a[of_field]
    assert np.abs(linked.shapes[0].query(points).signed_distance - found.distance[of_field]).max() <= 2 * bound
    assert found.statistics.touching == len(found) and found.converged.all()


def test_deepest_points_of_faces_are_those_of_the_processor(linked):
    for options in ({"mode": "node", "reduce": 4}, {"mode": "face", "contacts_per": "cell"}):
        expected, found = linked.detect(**options), linked.detect(**options, device="wgpu:0")
        assert abs(expected.distance.min() - found.distance.min()) < 1e-5 * DIAGONAL
        assert len(found.reductions) == len(expected.reductions)
        assert set(zip(found.instance_a, found.instance_b)) == set(zip(expected.instance_a, expected.instance_b))


def test_a_detector_follows_the_scene(linked, asset):
    first = linked.detect(mode="node", device="wgpu:0")
    linked.update([1], poses=[[9, 0, 0, 0, 0, 0, 1]])
    assert len(first) > 0 and len(linked.detect(mode="node", device="wgpu:0")) == 0
    linked.add(linked.add_shape(tesdf.Sphere(0.5)), [1, 0, 0, 0, 0, 0, 1])
    again = linked.detect(mode="node", contact_distance=0.1, device="wgpu:0")
    assert len(again) > 0 and set(again.instance_a) | set(again.instance_b) == {0, 2}
    options = dict(pose_b=LINKED, mode="node")
    assert np.array_equal(tesdf.collide(asset, asset, **options, device="wgpu:0").distance, first.distance)


def test_what_a_device_cannot_do(linked):
    with pytest.raises(tesdf.CollideError, match="contact_distance is -1e0"):
        linked.detect(contact_distance=-1.0, device="wgpu:0")
    with pytest.raises(TypeError, match="why.. has no keyword 'device'"):
        linked.why(0, 1, device="wgpu:0")


def test_answers_to_numpy_are_those_of_the_processor(asset, torus, points, device):
    points = np.concatenate([points, [[np.nan, 0, 0], [0, np.inf, 0]]])
    expected, found = asset.query(points), asset.query(points, device=device)
    assert [a.dtype for a in found] == [a.dtype for a in expected] and [a.shape for a in found] == [a.shape for a in expected]
    finite = np.isfinite(points).all(1)
    assert np.isnan(found.signed_distance[~finite]).all() and (found.face[~finite] == tesdf.NO_FACE).all()
    bound = error(points[finite])
    assert (np.abs(found.signed_distance - expected.signed_distance)[finite] <= bound).all()
    back = found.closest_point + found.signed_distance[:, None] * found.gradient
    assert (np.linalg.norm(back - points, axis=1)[finite] <= 4 * bound).all()
    assert (to_faces(torus, points[finite], found.face[finite]) <= np.abs(found.signed_distance[finite]) + 2 * bound).all()
    assert [len(a) for a in asset.query(np.zeros((0, 3)), device=device)] == [0, 0, 0, 0]


def test_answers_stay_with_points_on_the_device(asset, torus, points, device):
    points = points.astype(np.float32)
    array = tesdf.DeviceArray(points, device)
    assert (array.shape, array.dtype, len(array)) == (points.shape, np.float32, len(points))
    assert np.array_equal(array.numpy(), points) and array.device in repr(array)
    found = asset.query(array)
    assert type(found) is tesdf.DeviceAnswers and {part.device for part in found} == {array.device}
    assert [part.shape for part in found] == [(len(points),), points.shape, points.shape, (len(points),)]
    expected = asset.query(points)
    distance, gradient, closest, row = (part.numpy() for part in found)
    assert (np.abs(distance - expected.signed_distance) <= 2 * error(points)).all()
    assert (np.linalg.norm(closest + distance[:, None] * gradient - points, axis=1) <= 8 * error(points)).all()
    assert (to_faces(torus, points, asset.face_ids[row]) <= np.abs(distance) + 2 * error(points)).all()
    with pytest.raises(ValueError, match=f"points: an array on .*; expected one on "):
        asset.query(array, device=DEVICES[1 - DEVICES.index(device)])
    for wrong in (np.zeros((4, 2)), np.zeros(3), np.zeros((4, 3), np.uint32)):
        with pytest.raises(ValueError, match="points: an array of shape .*; expected float32 of shape"):
            asset.query(tesdf.DeviceArray(wrong, device))


def test_arrays_that_a_device_does_not_take(device):
    for wrong, text in ((np.zeros((2, 2, 2)), "shape"), (np.zeros(3, np.int64), "int64; expected float32 or uint32")):
        with pytest.raises(ValueError, match=text):
            tesdf.DeviceArray(wrong, device)
    with pytest.raises(ValueError, match='device: "cpu"; expected a device other than the processor'):
        tesdf.DeviceArray(np.zeros(3), "cpu")
    ids = np.arange(5, dtype=np.uint32)
    assert np.array_equal(tesdf.DeviceArray(ids, device).numpy(), ids) and tesdf.DeviceArray(ids[:0], device).numpy().size == 0


def test_a_device_without_cuda_copies_to_numpy_only(points):
    array = tesdf.DeviceArray(points, "wgpu:0")
    assert not hasattr(array, "__cuda_array_interface__")
    for refused in (array.__dlpack__, array.__dlpack_device__):
        with pytest.raises(BufferError, match=r"a pointer of CUDA on .*, or copy the array with numpy\(\)"):
            refused()
    assert np.array_equal(np.from_dlpack(array, device="cpu"), points.astype(np.float32))
    with pytest.raises(BufferError, match="it has to be copied"):
        array.__dlpack__(dl_device=(1, 0), copy=False)


class _Tensor(ctypes.Structure):
    """DLTensor of DLPack, which a DLManagedTensor begins with"""

    _fields_ = [("data", ctypes.c_void_p), ("device_type", ctypes.c_int32), ("device_id", ctypes.c_int32),
                ("ndim", ctypes.c_int32), ("code", ctypes.c_uint8), ("bits", ctypes.c_uint8), ("lanes", ctypes.c_uint16),
                ("shape", ctypes.POINTER(ctypes.c_int64)), ("strides", ctypes.POINTER(ctypes.c_int64)), ("byte_offset", ctypes.c_uint64)]


def tensor_of(capsule, name=b"dltensor"):
    get = ctypes.pythonapi.PyCapsule_GetPointer
    get.restype, get.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    return _Tensor.from_address(get(capsule, name))


class ByInterface:
    """an array of another library, by the protocol of numba"""

    def __init__(self, array, **changed):
        self.owner = array
        self.__cuda_array_interface__ = {**array.__cuda_array_interface__, **changed}


class ByDlpack:
    """an array of another library, by DLPack"""

    def __init__(self, array):
        self.owner, self.asked = array, []

    def __dlpack_device__(self):
        return self.owner.__dlpack_device__()

    def __dlpack__(self, **asked):
        self.asked.append(asked)
        return self.owner.__dlpack__(**asked)


def test_cuda_memory_is_used_in_place(asset, points):
    array = tesdf.DeviceArray(points, "cuda:0")
    assert array.__dlpack_device__() == (2, 0)
    interface = array.__cuda_array_interface__
    assert interface["shape"] == points.shape and interface["typestr"] == "<f4" and interface["strides"] is None
    # Both protocols give the address of the array itself.
    capsule = array.__dlpack__()
    tensor = tensor_of(capsule)
    assert tensor.data + tensor.byte_offset == interface["data"][0]
    assert (tensor.device_type, tensor.device_id, tensor.code, tensor.bits, tensor.lanes) == (2, 0, 2, 32, 1)
    assert tensor.shape[:2] == list(points.shape) and tensor.strides[:2] == [3, 1]
    expected = asset.query(array).signed_distance.numpy()
    by_dlpack = ByDlpack(array)
    for other in (ByInterface(array), by_dlpack):
        found = asset.query(other, device="cuda:0")
        assert type(found) is tesdf.DeviceAnswers and np.array_equal(found.signed_distance.numpy(), expected)
    # The owner is asked to wait for its work in the legacy default stream.
    assert by_dlpack.asked[0]["stream"] == 1
    rows = found.face_row
    assert '"dltensor_versioned"' in repr(rows.__dlpack__(max_version=(1, 0)))
    assert np.array_equal(np.from_dlpack(rows, device="cpu"), rows.numpy())


def test_answers_on_cuda_outlive_their_array(asset, points):
    answers = asset.query(tesdf.DeviceArray(points, "cuda:0"))
    expected = answers.gradient.numpy()
    capsule = answers.gradient.__dlpack__()
    again = asset.query(ByDlpack(answers.closest_point), device="cuda:0")
    assert np.abs(again.signed_distance.numpy()).max() < 8 * DISTANCE * 50
    del answers, again
    if any("CUDA on the CPU" in device.name for device in tesdf.devices()):
        memory = (ctypes.c_float * expected.size).from_address(tensor_of(capsule).data)
        assert np.array_equal(np.array(memory).reshape(expected.shape), expected)


def test_cuda_memory_that_is_refused(asset, points):
    array = tesdf.DeviceArray(points, "cuda:0")
    for changed, text in (
        ({"typestr": "<f8"}, "numbers of the type \"<f8\"; expected float32"),
        ({"shape": (3, 4)}, r"an array of shape \[3, 4\]; expected float32 of shape \(N, 3\)"),
        ({"strides": (24, 4)}, "expected float32 of shape"),
        ({"stream": 2}, "an array of the stream 2; expected the legacy default stream"),
    ):
        with pytest.raises(ValueError, match=text):
            asset.query(ByInterface(array, **changed), device="cuda:0")
    with pytest.raises(ValueError, match="points: an array of shape .*; expected float32"):
        asset.query(ByDlpack(tesdf.DeviceArray(points[:, :2], "cuda:0")), device="cuda:0")
    with pytest.raises(ValueError, match="points: an array on cuda:0; expected one on "):
        asset.query(ByDlpack(array), device="wgpu:0")
    # Without a device it would have to be copied to the processor.
    with pytest.raises((BufferError, RuntimeError)):
        asset.query(ByDlpack(array))


def rows_of(found):
    arrays = [found.instances.numpy(), found.distance.numpy()[:, None], found.point_a.numpy()]
    rows = np.hstack([array.astype(np.float64) for array in arrays])
    return rows[np.lexsort(rows.T[::-1])]


def test_contacts_stay_on_the_device(linked, device):
    reach = 0.03
    for options in ({"mode": "node"}, {"mode": "exact", "reduce": 8, "contacts_per": "face"}):
        expected = linked.detect(contact_distance=reach, device=device, **options)
        found = linked.detect_on_device(contact_distance=reach, device=device, **options)
        assert type(found) is tesdf.DeviceContacts and len(found) == len(expected) > 0
        arrays = found.point_a, found.point_b, found.normal, found.distance, found.instances
        assert [a.shape[1:] for a in arrays] == [(3,), (3,), (3,), (), (2,)] and {len(a) for a in arrays} == {len(found)}
        assert [a.dtype for a in arrays] == [np.float32] * 4 + [np.uint32] and len(found.hidden) == 0
        # Those of `detect`, rounded.
        rows = np.column_stack([expected.instance_a, expected.instance_b, expected.distance, expected.point_a])
        there = rows_of(found)
        nearest = np.abs(there[:, None] - rows[None]).max(axis=2)
        assert (nearest.min(axis=0) < 1e-6).all() and (nearest.min(axis=1) < 1e-6).all()
        distance = found.distance.numpy()
        back = found.point_b.numpy() + distance[:, None] * found.normal.numpy()
        # A face's nearest place is known to the root of the distance's error.
        place = 0 if options["mode"] == "node" else np.sqrt(8 * DISTANCE * DIAGONAL * np.abs(distance))
        off = np.linalg.norm(back - found.point_a.numpy(), axis=1)
        assert (off < 8 * DISTANCE * DIAGONAL + place).all()


def test_poses_come_from_arrays(linked, asset, device):
    options = {"mode": "node", "contact_distance": 0.03}
    apart = tesdf.Scene()
    apart.add_many(apart.add_shape(asset), [[0, 0, 0, 0, 0, 0, 1], [90, 0, 0, 0, 0, 0, 1]])
    expected = rows_of(linked.detect_on_device(device=device, **options))
    poses = linked.instances.poses.astype(np.float32)
    for given in (poses, poses.astype(np.float64), tesdf.DeviceArray(poses, device)):
        found = apart.detect_on_device(poses=given, device=device, **options)
        assert len(found) == len(expected) > 0 and np.abs(rows_of(found) - expected).max() < 2e-6
    assert len(apart.detect_on_device(poses=tesdf.DeviceArray(poses, device), **options)) == len(expected)
    assert len(apart.detect_on_device(device=device, **options)) == 0
    # The bodies come nearer by 0.1 in a second.
    velocities = np.array([[0, 0, 0, 0, 0, 0], [0, 0, 0.1, 0, 0, 0]])
    ahead = apart.detect_on_device(poses=poses, velocities=velocities, speculative_time=1.0, device=device, **options)
    assert len(ahead) > len(expected)
    assert np.array_equal(apart.instances.poses[1, :3], [90, 0, 0])


def test_arrays_of_poses_that_are_refused(linked, device):
    poses = linked.instances.poses
    detect = lambda **given: linked.detect_on_device(mode="node", device=device, **given)  # noqa: E731
    with pytest.raises(ValueError, match=r"poses: an array of shape \[2, 6\]; expected float32 of shape \(N, 7\)"):
        detect(poses=poses[:, :6])
    with pytest.raises(ValueError, match="velocities: an array without poses; expected both, or poses alone"):
        detect(velocities=np.zeros((2, 6)))
    with pytest.raises(tesdf.DeviceError, match='"poses" has 7 elements; expected 14: 7 for each of 2 instances'):
        detect(poses=poses[:1])
    with pytest.raises(tesdf.DeviceError, match="instance 1: the arrays place it at .*NaN.*; expected finite numbers"):
        detect(poses=np.where(np.arange(14).reshape(2, 7) == 8, np.nan, poses))
    with pytest.raises(tesdf.DeviceError, match="leaving one contact of all faces at a vertex there is not available"):
        linked.detect_on_device(device=device)
    with pytest.raises(ValueError, match='device: "cpu"; expected a device other than the processor'):
        linked.detect_on_device(device="cpu")


def test_a_simulation_on_a_device_agrees_with_the_processor():
    box = {"box": {"half_extents": [0.02, 0.02, 0.02]}}
    scene = {
        "time_step": 2e-3, "duration": 0.06, "detector": {"mode": "node"},
        "bodies": [{"name": "floor", "shape": "plane", "fixed": True},
                   {"name": "box", "shape": box, "mass": 0.1, "translation": [0, 0, 0.0205]}],
    }
    host, there = tesdf.Simulation(scene), tesdf.Simulation(scene, device="wgpu:0")
    host.run()
    for _ in range(30):
        there.step()
    assert there.steps == host.steps == 30 and len(there.contacts) > 0
    # A micrometre of 0.5 mm of free fall.
    assert np.abs(there.poses - host.poses).max() < 1e-6 and host.poses[1, 2] < 0.02005
    with pytest.raises(tesdf.DeviceError, match="no device is named"):
        tesdf.Simulation(scene, device="no such")


def test_the_coupling_to_mujoco_takes_a_device(tmp_path):
    import mujoco
    import tesdf.mujoco

    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = np.array([face for a, b, c, d in quads for face in ([a, b, c], [a, c, d])])
    (tmp_path / "cube.obj").write_text("".join("v {} {} {}\n".format(*v) for v in corners)
                                       + "".join("f {} {} {}\n".format(*(f + 1)) for f in faces))
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <asset><mesh name="cube" file="{tmp_path}/cube.obj"/></asset>
      <worldbody>
        <geom name="below" type="mesh" mesh="cube"/>
        <body pos="0.5 0.3 1.99"><freejoint/><geom name="above" type="mesh" mesh="cube"/></body>
      </worldbody></mujoco>""")
    cube = tesdf.encode(tmp_path / "cube.obj", "fast")
    counts = []
    for options in ({}, {"device": "wgpu:0"}):
        data = mujoco.MjData(model)
        contacts = tesdf.mujoco.Contacts(model, {"below": cube, "above": cube}, **options)
        contacts.step(model, data)
        counts.append(data.ncon)
        assert abs(contacts.last.distance.min() + 0.01) < 1e-5
    assert counts[0] == counts[1] > 0


def _detect_in_child(results):
    try:
        tesdf.collide(tesdf.Sphere(1), tesdf.Sphere(1), mode="node", device="wgpu:0")
    except tesdf.DeviceError as e:
        results.put(str(e))


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_cannot_use_the_devices_of_its_parent():
    near = [1.5, 0, 0, 0, 0, 0, 1]
    assert len(tesdf.collide(tesdf.Sphere(1), tesdf.Sphere(1), pose_b=near, mode="node", device="wgpu:0")) > 0
    context = multiprocessing.get_context("fork")
    results = context.Queue()
    child = context.Process(target=_detect_in_child, args=(results,))
    child.start()
    text = results.get(timeout=60)
    child.join()
    assert "was forked from one that has used a device" in text and 'get_context("spawn")' in text
