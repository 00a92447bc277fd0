"""Derivatives against central differences at smooth places, and at known kinks."""

import numpy as np
import pytest
import tesdf
import tesdf.torch
import torch
from conftest import PARTS

STEP = 1e-6


@pytest.fixture(scope="module")
def random():
    return np.random.default_rng(7)


def poses(random, count, spread):
    """poses [count, 7] around the origin"""
    rotation = random.normal(size=(count, 4))
    return torch.tensor(np.concatenate([random.normal(scale=spread, size=(count, 3)), rotation], 1))


def differences(f, x, step=STEP):
    """central differences of f, whose rows depend on the rows of x each: [N, ...]"""
    found = torch.zeros_like(x)
    for k in range(x[0].numel()):
        delta = torch.zeros_like(x).reshape(len(x), -1)
        delta[:, k] = step
        delta = delta.reshape(x.shape)
        found.reshape(len(x), -1)[:, k] = (f(x + delta) - f(x - delta)) / (2 * step)
    return found


def derivative(f, x):
    x = x.clone().requires_grad_()
    f(x).sum().backward()
    return x.grad


def assert_smooth(f, x, *, share=0.9, error=1e-6, step=STEP):
    """Derivatives are the central differences wherever these are the same with another step: elsewhere
    they reach over a kink."""
    found, coarse, fine = derivative(f, x), differences(f, x, 2 * step), differences(f, x, step)
    smooth = ((coarse - fine).abs().reshape(len(x), -1) < error / 2).all(1)
    assert smooth.double().mean() >= share
    assert (found - fine)[smooth].abs().max() < error
    assert found.abs().max() > 0.1


def test_signed_distance_by_points_poses_and_scales(asset, random):
    points = torch.tensor(random.uniform(-1.6, 1.6, (500, 3)))
    distance = lambda x: tesdf.torch.signed_distance(asset, x)  # noqa: E731
    assert torch.equal(distance(points), torch.from_numpy(asset.signed_distance(points.numpy())))
    assert_smooth(distance, points)
    at = poses(random, 40, 0.3)
    assert_smooth(lambda x: tesdf.torch.signed_distance(asset, points[:1], x)[:, 0], at)
    assert_smooth(lambda x: tesdf.torch.signed_distance(asset, points[:1], at, x)[:, 0], torch.tensor(random.uniform(0.5, 2, 40)))
    matrices = torch.eye(4, dtype=torch.float64).repeat(40, 1, 1)
    matrices[:, :3, :3] = torch.linalg.qr(torch.tensor(random.normal(size=(40, 3, 3))))[0]
    matrices[torch.linalg.det(matrices) < 0, :3, 0] *= -1

    def turned(twist):
        zero = torch.zeros(len(twist), dtype=torch.float64)
        w = twist[:, 3:]
        cross = torch.stack([zero, -w[:, 2], w[:, 1], w[:, 2], zero, -w[:, 0], -w[:, 1], w[:, 0], zero], -1).reshape(-1, 3, 3)
        motion = torch.eye(4, dtype=torch.float64).repeat(len(twist), 1, 1)
        motion = torch.cat([torch.cat([torch.linalg.matrix_exp(cross), twist[:, :3, None]], 2), motion[:, 3:]], 1)
        return tesdf.torch.signed_distance(asset, points[:1], motion @ matrices)[:, 0]

    assert_smooth(turned, torch.zeros(40, 6, dtype=torch.float64))


def test_axes_of_points_poses_and_meshes(asset, random):
    points, at = torch.tensor(random.uniform(-1, 1, (5, 3))), poses(random, 3, 0.2)
    assert tesdf.torch.signed_distance(asset, points[0]).shape == ()
    assert tesdf.torch.signed_distance(asset, points, at[0]).shape == (5,)
    all_poses = tesdf.torch.signed_distance(asset, points, at, torch.tensor([1.0, 2, 3]))
    assert all_poses.shape == (3, 5)
    assert torch.equal(all_poses[1], tesdf.torch.signed_distance(asset, points, at[1], 2.0))
    cube = tesdf.encode(PARTS / "cube.obj", "fast")
    several = tesdf.torch.signed_distance([asset, cube], points, at[:2])
    assert torch.equal(several[1], tesdf.torch.signed_distance(cube, points, at[1])) and several.shape == (2, 5)
    assert tesdf.torch.signed_distance([asset, cube], points).shape == (2, 5)
    distance, gradient = tesdf.torch.signed_distance_and_gradient(asset, points.requires_grad_(), at)
    (by_points,) = torch.autograd.grad(distance[1].sum(), points)
    assert torch.allclose(gradient[1], by_points, atol=1e-12) and not gradient.requires_grad
    single = tesdf.torch.signed_distance(asset, points.float().detach(), at.float())
    assert single.dtype == torch.float32 and torch.allclose(single.double(), distance, atol=1e-6)


def test_contiguous_points_are_not_copied(asset):
    points = torch.rand(1000, 3, dtype=torch.float64)
    seen = []

    class Seen:
        def query(self, array, precision):
            seen.append(array.__array_interface__["data"][0])
            return asset.query(array, precision)

    context = torch.autograd.function.FunctionCtx()
    context.save_for_backward = context.mark_non_differentiable = lambda *_: None
    tesdf.torch._SignedDistance.forward(context, points, Seen(), "f64")
    assert seen == [points.data_ptr()]


def test_kinks_of_signed_distance():
    box = tesdf.encode(PARTS / "cube.obj", "fast")
    # On a plane of symmetry two sides are equally near: the derivative is that of one of them.
    middle = torch.tensor([[0.004, 0.004, 0.0]], dtype=torch.float64)
    found = derivative(lambda x: tesdf.torch.signed_distance(box, x), middle)[0]
    assert found.tolist() in ([1, 0, 0], [0, 1, 0])
    # To both sides it is as it is there.
    for x, y in ((0.005, 0.004), (0.004, 0.005)):
        beside = derivative(lambda x: tesdf.torch.signed_distance(box, x), torch.tensor([[x, y, 0.0]], dtype=torch.float64))
        assert beside[0].tolist() == [float(x > y), float(y > x), 0]


@pytest.mark.parametrize("spread", [0.6, 2.5], ids=["overlapping", "mostly apart"])
def test_clearance_by_both_poses(asset, random, spread):
    a, b = poses(random, 30, 0.1), poses(random, 30, spread)
    # The tolerance bounds the error of the distance, and differences divide it by their step.
    clearance = lambda a, b, **k: tesdf.torch.clearance(asset, asset, a, b, tolerance=1e-13, **k)  # noqa: E731
    assert (torch.sign(clearance(a, b)) == (1 if spread > 1 else -1)).double().mean() > 0.6
    assert_smooth(lambda x: clearance(x, b), a, share=0.7)
    assert_smooth(lambda x: clearance(a, x), b, share=0.7)
    sizes = torch.tensor(random.uniform(0.7, 1.3, 30))
    assert_smooth(lambda x: clearance(a, b, scale_a=x), sizes, share=0.7)
    assert_smooth(lambda x: clearance(a, b, scale_b=x), sizes, share=0.7)


def test_clearance_is_that_of_tesdf(asset):
    apart = torch.tensor([3.0, 0.2, 0.1, 0, 0, 0, 1], dtype=torch.float64)
    found = tesdf.torch.clearance(asset, tesdf.Sphere(0.3), None, apart)
    assert found.shape == () and found.item() == tesdf.clearance(asset, tesdf.Sphere(0.3), None, apart.numpy()).distance
    rows = tesdf.torch.clearance(asset, asset, apart.expand(2, 1, 7), torch.zeros(3, 7, dtype=torch.float64) + torch.eye(7)[6])
    assert rows.shape == (2, 3)


def test_kinks_of_clearance():
    # A cube over the middle between two others that turns: the nearest corner changes.
    half = 0.01
    at = lambda angle: torch.stack([*torch.zeros(2), torch.tensor(0.05), torch.zeros(()), torch.sin(angle / 2), torch.zeros(()), torch.cos(angle / 2)])  # noqa: E731
    angle = torch.tensor(0.0, dtype=torch.float64, requires_grad=True)
    distance = lambda angle: tesdf.torch.clearance(PARTS / "cube.obj", tesdf.Plane(), at(angle).double())  # noqa: E731
    distance(angle).backward()
    # Flat above the plane all points of its side are nearest. It comes nearer to both sides by half of its
    # side for each radian, and the derivative is that of the point that was found.
    assert abs(angle.grad) <= half
    for side in (-1e-3, 1e-3):
        beside = torch.tensor(side, dtype=torch.float64, requires_grad=True)
        distance(beside).backward()
        assert beside.grad == pytest.approx(-np.sign(side) * half, abs=1.1e-3 * half)


def test_time_of_impact_by_poses_and_velocities(asset, random):
    a, b = poses(random, 20, 0.05), poses(random, 20, 0.05)
    b[:, 0] += 4
    still, fast = torch.tensor(random.normal(scale=0.2, size=(20, 6))), torch.tensor(random.normal(scale=0.1, size=(20, 6)))
    fast[:, 0] -= 3

    def time(a=a, b=b, va=still, vb=fast):
        return tesdf.torch.time_of_impact(asset, asset, a, b, va, vb, tolerance=1e-11, end=3.0)

    assert time().isfinite().double().mean() > 0.9 and time().min() > 0.1
    hits = time().isfinite()
    a, b, still, fast = a[hits], b[hits], still[hits], fast[hits]
    smooth = {"share": 0.8, "step": 1e-4}  # times are known to the tolerance
    assert_smooth(lambda x: time(x, b, still, fast), a, **smooth)
    assert_smooth(lambda x: time(a, x, still, fast), b, **smooth)
    assert_smooth(lambda x: time(a, b, x, fast), still, **smooth)
    assert_smooth(lambda x: time(a, b, still, x), fast, **smooth)


def test_times_without_derivatives(asset):
    b = torch.tensor([[4.0, 0, 0, 0, 0, 0, 1], [0.5, 0, 0, 0, 0, 0, 1], [4, 0, 0, 0, 0, 0, 1]], dtype=torch.float64, requires_grad=True)
    velocity = torch.tensor([[9.0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0], [-9, 0, 0, 0, 0, 0]], dtype=torch.float64)
    time = tesdf.torch.time_of_impact(asset, asset, None, b, None, velocity)
    assert time[0] == torch.inf and time[1] == 0 and 0 < time[2] < 1
    time.sum().backward()
    assert (b.grad[:2] == 0).all() and b.grad[2, 0] == pytest.approx(1 / 9)


def lowest_of_faces(asset, contacts, poses):
    """the rows of contacts at the lowest points of their faces, by samples of these, by body and face"""
    row_of = {face: row for row, face in enumerate(asset.face_ids.tolist())}
    grid = np.array([(i, j, 40 - i - j) for i in range(41) for j in range(41 - i)]) / 40
    rows = {}
    for row in np.flatnonzero(contacts.converged):
        surface = int(contacts.instance_a[row])
        matrices = [tesdf.torch._parts("pose", pose) for pose in poses]
        (r, t), (rb, tb) = ([x.numpy() for x in matrices[body]] for body in (surface, 1 - surface))
        corners = asset.vertices[asset.faces[row_of[contacts.face_a[row]]]] @ r.T + t
        # Over the face, and over parts of it around the point.
        sizes = 10.0 ** -np.arange(6)[:, None, None]
        points = contacts.point_a[row] + sizes * (grid @ corners - contacts.point_a[row])
        if asset.signed_distance((points.reshape(-1, 3) - tb) @ rb).min() > contacts.distance[row] - 1e-11:
            rows[surface, int(contacts.feature_a[row])] = row
    return rows


@pytest.mark.parametrize("options", [{"tolerance": 1e-13}, {"mode": "node"}], ids=["exact", "node"])
@pytest.mark.parametrize("move", [0, 1], ids=["a", "b"])
def test_contacts_by_both_poses(asset, random, options, move):
    compared = 0
    for _ in range(1 if "tolerance" in options else 3):
        given = [poses(random, 1, 0.01)[0] for _ in range(2)]
        given[1][0] += 1.7

        def contacts(pose):
            both = [pose, given[1]] if move == 0 else [given[0], pose]
            found = tesdf.torch.collide(asset, asset, *both, contact_distance=0.05, **options)
            if "mode" in options:
                names = zip(found.contacts.instance_a.tolist(), found.contacts.feature_a.tolist())
                return found, {name: row for row, name in enumerate(names)}
            return found, lowest_of_faces(asset, found.contacts, [x.detach() for x in both])

        pose = given[move].clone().requires_grad_()
        found, names = contacts(pose)
        rows = [torch.autograd.grad(distance, pose, retain_graph=True)[0] for distance in found.distance]
        for k in range(7):
            delta = STEP * torch.eye(7, dtype=torch.float64)[k]
            (up, name_up), (down, name_down) = contacts(given[move] + delta), contacts(given[move] - delta)
            for name in names.keys() & name_up.keys() & name_down.keys():
                middle = found.distance[names[name]].item()
                slopes = [(up.distance[name_up[name]] - middle) / STEP, (middle - down.distance[name_down[name]]) / STEP]
                if abs(slopes[0] - slopes[1]) < 1e-6 * max(1, abs(slopes[0])):  # no kink between
                    compared += 1
                    assert rows[names[name]][k].item() == pytest.approx((sum(slopes) / 2).item(), abs=1e-6, rel=1e-6)
    assert compared > 30


def test_contacts_whose_distances_have_no_derivatives(asset):
    for wrong in ("cell", "minimum"):
        with pytest.raises(ValueError, match=f"contacts_per: '{wrong}'; expected 'face'"):
            tesdf.torch.collide(asset, asset, contacts_per=wrong)


def test_second_derivatives_are_errors(asset):
    points = torch.rand(3, 3, dtype=torch.float64, requires_grad=True)
    (gradient,) = torch.autograd.grad(tesdf.torch.signed_distance(asset, points).sum(), points, create_graph=True)
    with pytest.raises(RuntimeError, match="first derivatives only"):
        gradient.sum().backward()
    pose = torch.tensor([3.0, 0, 0, 0, 0, 0, 1], dtype=torch.float64, requires_grad=True)
    (gradient,) = torch.autograd.grad(tesdf.torch.clearance(asset, asset, None, pose), pose, create_graph=True)
    with pytest.raises(RuntimeError, match="first derivatives only"):
        gradient.sum().backward()


@pytest.mark.filterwarnings("default")
def test_compiled_programs_call_it(asset):
    points = torch.rand(100, 3, dtype=torch.float64, requires_grad=True)

    def loss(points):
        return (tesdf.torch.signed_distance(asset, points * 2) ** 2).sum()

    compiled = torch.compile(loss, backend="eager")
    assert torch.equal(compiled(points), loss(points))
    (found,) = torch.autograd.grad(compiled(points), points)
    assert torch.equal(found, torch.autograd.grad(loss(points), points)[0])
    torch._dynamo.reset()
    with pytest.raises(torch._dynamo.exc.Unsupported):
        torch.compile(loss, backend="eager", fullgraph=True)(points)


def test_refused_arguments(asset):
    points = torch.rand(4, 3, dtype=torch.float64)
    for call, text in (
        (lambda: tesdf.torch.signed_distance(asset, points[:, :2]), r"points: a tensor of shape \(4, 2\); expected shape \(\.\.\., N, 3\)"),
        (lambda: tesdf.torch.signed_distance(asset, points, torch.zeros(7)), "pose: a quaternion of length 0"),
        (lambda: tesdf.torch.signed_distance(asset, points, torch.eye(4) * 2), "pose: a matrix that deforms"),
        (lambda: tesdf.torch.clearance(asset, asset, torch.zeros(6)), r"pose_a: a tensor of shape \(6,\)"),
        (lambda: tesdf.torch.signed_distance([asset], points.expand(2, 4, 3)), "mesh: 1 meshes for 2 rows"),
        (lambda: tesdf.torch.time_of_impact(asset, asset, velocity_a=torch.zeros(3)), "velocity_a: a tensor of shape"),
    ):
        with pytest.raises(ValueError, match=text):
            call()
