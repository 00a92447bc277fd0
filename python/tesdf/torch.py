"""Signed distances, clearances, times of impact and contacts with derivatives, for PyTorch.

    import tesdf.torch

    distance = tesdf.torch.signed_distance("part.stl", points, pose)    # by points, pose and scale
    room = tesdf.torch.clearance("peg.stl", "hole.stl", pose_a, pose_b) # by both poses and scales
    room.backward()

A pose has seven numbers, x y z qx qy qz qw, or is a matrix [4, 4]; with axes in front, [..., 7] or
[..., 4, 4], there are many, on all threads. Quaternions are normalised, so that an optimiser may step
along any of their numbers. Meshes are those of `tesdf.signed_distance`: encoded once, found by their
content.

Derivatives are exact: where p_a and p_b are the witness points and n is the unit normal from b to a, a
motion changes the distance by n · (δp_a − δp_b). Where bodies overlap and the deepest point is as near to
several faces, a mean of their normals takes the place of n, found from the balance at that point. Where
the found points are about to change from one place of a surface to another (a point as near to two faces,
a clearance with two closest places), the distance has a kink, and the derivative is that of the found
points: the one to one side. There are first derivatives only: a second one is an error.

CPU tensors: contiguous float64 points are read, and distances handed out, without a copy. Computations
are in float64, results have the type of the points or poses. CUDA tensors: `signed_distance` is
evaluated on their device in float32 if the package was built with the GPU, and is a `DeviceError`
otherwise; poses of the other functions are copied to the processor, and results back. `torch.compile`
leaves these functions out of its graphs, and calls them as they are: with `fullgraph=True` they are an
error.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import torch
from torch import Tensor

from . import _derivatives, _native
from .contacts import Clearances, Contacts
from .shapes import SIMPLE

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .bodies import Body, DetectOptions, Mesh

__all__ = ["ContactDistances", "clearance", "collide", "signed_distance", "signed_distance_and_gradient", "time_of_impact"]




@torch.compiler.disable
def signed_distance(
    mesh: Mesh | list[Mesh],
    points: Tensor,
    pose: Tensor | None = None,
    scale: Tensor | float | None = None,
    *,
    precision: Literal["f64", "f32"] = "f64",
) -> Tensor:
    """The signed distances [..., N] of points [..., N, 3] to a mesh with poses and scales [...].

    The axes in front of points, poses and scales broadcast: points [1000, 3] and poses [64, 7] give
    [64, 1000]. Without a pose, a point [3] gives a number. With a list of S meshes, the first axis of
    the result is that of the meshes: poses [S, 7] are theirs.
    """
    return signed_distance_and_gradient(mesh, points, pose, scale, precision=precision)[0]


@torch.compiler.disable
def signed_distance_and_gradient(
    mesh: Mesh | list[Mesh],
    points: Tensor,
    pose: Tensor | None = None,
    scale: Tensor | float | None = None,
    *,
    precision: Literal["f64", "f32"] = "f64",
) -> tuple[Tensor, Tensor]:
    """As `signed_distance`, and the unit gradients [..., N, 3] by the points, which have no derivative
    of their own."""
    if points.ndim == 0 or points.shape[-1] != 3:
        raise ValueError(f"points: a tensor of shape {tuple(points.shape)}; expected shape (..., N, 3)")
    local = points if points.ndim > 1 else points[None]
    rotation = factor = None
    if scale is not None:
        factor = torch.as_tensor(scale, dtype=torch.float64, device=points.device)[..., None]
    if pose is not None:
        rotation, translation = _parts("pose", pose.to(points.device))
        rotation, translation = rotation[..., None, :, :], translation[..., None, :]
        local = (rotation.mT @ (local.double() - translation)[..., None])[..., 0]
    if factor is not None:
        local = local / factor[..., None]
    if isinstance(mesh, list):
        if local.ndim < 3:
            local = local.expand(len(mesh), *local.shape)
        if local.shape[0] != len(mesh):
            raise ValueError(f"mesh: {len(mesh)} meshes for {local.shape[0]} rows of points or poses; expected one for each")
        found = [_query(each, at, precision) for each, at in zip(mesh, local)]
        distance, gradient = (torch.stack(of_meshes) for of_meshes in zip(*found))
    else:
        distance, gradient = _query(mesh, local, precision)
    if factor is not None:
        distance = distance * factor
    if rotation is not None:
        gradient = (rotation.detach() @ gradient[..., None])[..., 0]
    if points.ndim == 1:
        distance, gradient = distance[..., 0], gradient[..., 0, :]
    return distance.to(points.dtype), gradient.to(points.dtype)


def _query(mesh: Mesh, points: Tensor, precision: str) -> tuple[Tensor, Tensor]:
    distance, gradient = _SignedDistance.apply(points.reshape(-1, 3), _native.asset_of(mesh), precision)  # type: ignore[no-untyped-call]
    return distance.reshape(points.shape[:-1]), gradient.reshape(points.shape)


class _Once(torch.autograd.Function):
    """A first derivative by some points, whose own derivative by them is an error, and not 0."""

    @staticmethod
    def forward(ctx: Any, derivative: Tensor, points: Tensor) -> Tensor:
        return derivative.clone()

    @staticmethod
    def backward(ctx: Any, _: Tensor) -> Any:
        raise RuntimeError("tesdf.torch has first derivatives only, and the second one of a distance was asked for")


class _SignedDistance(torch.autograd.Function):
    """The distances and gradients of points [N, 3] in the frame of an asset."""

    @staticmethod
    def forward(ctx: Any, given: Tensor, asset: _native.Asset, precision: Literal["f64", "f32"]) -> tuple[Tensor, Tensor]:
        points = given.detach()
        if points.device.type == "cpu":
            found = asset.query(points.double().numpy(), precision)
            distance, gradient = torch.from_numpy(found.signed_distance), torch.from_numpy(found.gradient)
        else:
            device = f"{points.device.type}:{points.device.index or 0}"
            on_device: Any = asset.query(points.float().contiguous(), device=device)  # type: ignore[call-overload]
            distance, gradient = torch.from_dlpack(on_device.signed_distance), torch.from_dlpack(on_device.gradient)
            distance, gradient = distance.to(points.dtype), gradient.to(points.dtype)
        ctx.save_for_backward(given, gradient)
        ctx.mark_non_differentiable(gradient)
        return distance, gradient

    @staticmethod
    def backward(ctx: Any, by_distance: Tensor, _: Tensor) -> tuple[Tensor, None, None]:
        points, gradient = ctx.saved_tensors
        return _Once.apply((by_distance[..., None] * gradient).to(points.dtype), points), None, None  # type: ignore[no-untyped-call]


@torch.compiler.disable
def clearance(
    a: Body,
    b: Body,
    pose_a: Tensor | None = None,
    pose_b: Tensor | None = None,
    *,
    scale_a: Tensor | float | None = None,
    scale_b: Tensor | float | None = None,
    tolerance: float | None = None,
) -> Tensor:
    """The signed distances [...] between two bodies with poses and scales [...], as `tesdf.clearance`.

    Bodies and tolerance are those of `tesdf.clearance`. A clearance is searched to the tolerance, so its
    points, and with them the derivative, are as near to the true ones as that tells.
    """
    pair = _Pair(a, b, pose_a, pose_b, scale_a, scale_b)
    found = pair.scene.clearances(pair.ids, tolerance=tolerance)
    gradient, (point_a, point_b), depths = pair.gradients(found, tolerance)
    points = pair.moving_points(point_a, point_b)
    distance = _Distance.apply(*points, gradient, _tensor(found.distance))  # type: ignore[no-untyped-call]
    for depth, scale in zip(depths, pair.scales):
        # With its field, a body's depths grow.
        distance = distance + depth * (scale / scale.detach() - 1)
    return pair.result(distance)


@torch.compiler.disable
def time_of_impact(
    a: Body,
    b: Body,
    pose_a: Tensor | None = None,
    pose_b: Tensor | None = None,
    velocity_a: Tensor | None = None,
    velocity_b: Tensor | None = None,
    *,
    end: float = 1.0,
    tolerance: float | None = None,
    iterations: int = 1000,
) -> Tensor:
    """The first times [...] at which two bodies touch that start in poses [...] and have the constant
    velocities [..., 6], vx vy vz wx wy wz, as in `tesdf.time_of_impact`, which explains the rest.

    The derivatives are by poses and velocities. The time is inf where the bodies stay apart until the
    end, and NaN where it is undecided; there, and where they touch at the start, the derivatives are 0.
    They grow without bound where bodies graze each other.
    """
    pair = _Pair(a, b, pose_a, pose_b, None, None, velocity_a, velocity_b)
    velocities_a, velocities_b = (velocity.detach().numpy() for velocity in pair.velocities)
    found = pair.scene.times_of_impact(
        pair.ids, velocities_a=velocities_a, velocities_b=velocities_b, end=end, tolerance=tolerance, iterations=iterations
    )
    time, normal = _tensor(found.time), _tensor(found.normal)
    changes = _tensor(found.touches & (found.time > 0))
    at = torch.where(changes, time, 0.0)
    points = pair.moving_points(_tensor(found.point_a), _tensor(found.point_b), at)
    with torch.no_grad():
        speeds = [
            velocity[:, :3] + torch.linalg.cross(velocity[:, 3:], point - translation - velocity[:, :3] * at[:, None])
            for velocity, point, (_, translation) in zip(pair.velocities, points, pair.parts)
        ]
        rate = (normal * (speeds[0] - speeds[1])).sum(-1)
        by_points = torch.where(changes[:, None], -normal / rate[:, None], 0.0)
    return pair.result(_Distance.apply(*points, by_points, time))  # type: ignore[no-untyped-call]


class ContactDistances(NamedTuple):
    """The contacts of two bodies, with the derivatives of their distances."""

    distance: Tensor
    """[N] signed distances, negative where the bodies overlap"""
    contacts: Contacts
    """the contacts, as `tesdf.collide` has them"""


@torch.compiler.disable
def collide(
    a: Body,
    b: Body,
    pose_a: Tensor | None = None,
    pose_b: Tensor | None = None,
    **options: Unpack[DetectOptions],
) -> ContactDistances:
    """The contacts of two bodies in one pose each, and their distances with derivatives by the poses.
    `tesdf.collide` explains the options.

    The derivative is that of the least distance of a face, or of the distance of a vertex. A face that is
    large or lies flat also has contacts at its extremes: their derivative is that of the distance at this
    point of the body. contacts_per="cell" and "minimum" are errors.
    """
    if options.get("contacts_per") in ("cell", "minimum"):
        raise ValueError(f"contacts_per: '{options['contacts_per']}'; expected 'face', whose distances have derivatives")
    pair = _Pair(a, b, pose_a, pose_b, None, None)
    if pair.shape:
        raise ValueError(f"poses: axes {pair.shape} in front; expected one pose of each body")
    found = pair.scene.detect(**options)
    # The body of the face or vertex, a of the contact, may be either body.
    bodies = [pair.placed(body, 0) for body in (0, 1)]
    has_surface = (found.instance_a == pair.ids[0, 1]).astype(int)
    gradients = np.empty_like(found.normal)
    reach = max(body.reach(options.get("tolerance")) for body in bodies)
    rows_of = [_rows_of_faces(body.shape) for body in bodies]
    for row, (surface, point, distance) in enumerate(zip(has_surface, found.point_a, found.distance)):
        # `normal` may be turned to one that both bodies allow.
        between = (point - found.point_b[row]) / distance if distance else found.normal[row]
        gradient = between if abs(np.linalg.norm(between) - 1) < 1e-6 else found.normal[row]
        if distance < 0 and options.get("mode") != "node":
            if rows_of[surface] is None:
                along = _derivatives.along_surface(bodies[surface], point, reach)
            else:
                along = _derivatives.along_face(bodies[surface], point, rows_of[surface][found.face_a[row]], reach)
            change = _derivatives.of_depth(bodies[1 - surface], along, point, reach)
            gradient = gradient if change is None else change
        gradients[row] = -gradient if surface else gradient
    point_a, point_b = (_moved(_tensor(found.point_a), rotation, translation) for rotation, translation in pair.parts)
    distance = _Distance.apply(point_a, point_b, _tensor(gradients), _tensor(found.distance))  # type: ignore[no-untyped-call]
    return ContactDistances(distance.to(pair.device, pair.dtype), found)


def _rows_of_faces(shape: Any) -> Any:
    """The row of each face in `Asset.faces` by its id; None for other shapes."""
    if not isinstance(shape, _native.Asset):
        return None
    return {face: row for row, face in enumerate(shape.face_ids.tolist())}


class _Distance(torch.autograd.Function):
    """A number of each row that changes by `gradient` with the first points, and by its negative with
    the second ones."""

    @staticmethod
    def forward(ctx: Any, point_a: Tensor, point_b: Tensor, gradient: Tensor, number: Tensor) -> Tensor:
        ctx.save_for_backward(point_a, point_b, gradient)
        return number.clone()

    @staticmethod
    def backward(ctx: Any, by_number: Tensor) -> tuple[Tensor, Tensor, None, None]:
        point_a, point_b, gradient = ctx.saved_tensors
        # Rows without derivatives may be multiplied with infinite ones of what follows.
        product = torch.where(gradient == 0, 0.0, by_number[:, None] * gradient)
        product = _Once.apply(product, point_a + point_b)  # type: ignore[no-untyped-call]
        return product, -product, None, None


class _Pair:
    """Rows of two bodies each in one scene, and their poses as tensors on the processor."""

    def __init__(
        self,
        a: Body,
        b: Body,
        pose_a: Tensor | None,
        pose_b: Tensor | None,
        scale_a: Tensor | float | None,
        scale_b: Tensor | float | None,
        velocity_a: Tensor | None = None,
        velocity_b: Tensor | None = None,
    ) -> None:
        given = [t for t in (pose_a, pose_b, scale_a, scale_b, velocity_a, velocity_b) if isinstance(t, Tensor)]
        self.dtype = given[0].dtype if given else torch.float64
        self.device = given[0].device if given else torch.device("cpu")
        identity = torch.tensor([0.0, 0, 0, 0, 0, 0, 1], dtype=torch.float64)
        poses = [_parts(f"pose_{body}", identity if pose is None else pose.cpu()) for body, pose in (("a", pose_a), ("b", pose_b))]
        scales = [torch.as_tensor(1.0 if scale is None else scale, dtype=torch.float64).cpu() for scale in (scale_a, scale_b)]
        velocities = [torch.zeros(6, dtype=torch.float64) if v is None else v.cpu().double() for v in (velocity_a, velocity_b)]
        for body, velocity in zip("ab", velocities):
            if velocity.shape[-1:] != (6,):
                raise ValueError(f"velocity_{body}: a tensor of shape {tuple(velocity.shape)}; expected shape (..., 6)")
        shapes = [t.shape[:-1] for _, t in poses] + [s.shape for s in scales] + [v.shape[:-1] for v in velocities]
        self.shape = torch.broadcast_shapes(*shapes)
        self.parts = [(r.expand(*self.shape, 3, 3).reshape(-1, 3, 3), t.expand(*self.shape, 3).reshape(-1, 3)) for r, t in poses]
        self.scales = [scale.expand(self.shape).reshape(-1) for scale in scales]
        self.velocities = [velocity.expand(*self.shape, 6).reshape(-1, 6) for velocity in velocities]
        self.scene = _native.Scene()
        ids = []
        self.bodies: list[Any] = []
        for body_given, (rotation, translation), scale in zip((a, b), self.parts, self.scales):
            matrices = torch.eye(4, dtype=torch.float64).repeat(len(translation), 1, 1)
            matrices[:, :3, :3], matrices[:, :3, 3] = rotation.detach(), translation.detach()
            is_simple = isinstance(body_given, SIMPLE)
            shape: Any = body_given if is_simple else _native.asset_of(body_given)  # type: ignore[arg-type]
            self.bodies.append(shape)
            ids.append(self.scene.add_many(self.scene.add_shape(shape), matrices.numpy(), scale=scale.detach().numpy()))
        self.ids = np.stack(ids, 1)

    def gradients(self, found: Clearances, tolerance: float | None) -> tuple[Tensor, list[Tensor], list[Tensor]]:
        """By how much the distances change with points of a less points of b, [N, 3]; these points; and the depths in the
        field of each body at them."""
        gradient, points = found.normal.copy(), [found.point_a.copy(), found.point_b.copy()]
        depths = np.zeros((2, len(found)))
        for field in (0, 1):
            for row in np.flatnonzero((found.distance < 0) & (found.field == self.ids[:, field])).tolist():
                deepest = points[1 - field][row]
                of_field, of_surface = (self.placed(body, row) for body in (field, 1 - field))
                reach = max(of_field.reach(tolerance), of_surface.reach(tolerance))
                along = _derivatives.along_surface(of_surface, deepest, reach)
                change = _derivatives.of_depth(of_field, along, deepest, reach)
                if change is not None:
                    gradient[row] = change if field else -change
                    points[field][row] = deepest
                    depths[field, row] = found.distance[row]
        return _tensor(gradient), [_tensor(point) for point in points], [_tensor(depth) for depth in depths]

    def placed(self, body: int, row: int) -> _derivatives.Placed:
        rotation, translation = (part[row].detach().numpy() for part in self.parts[body])
        return _derivatives.Placed(self.bodies[body], rotation, translation, float(self.scales[body][row].detach()))

    def moving_points(self, point_a: Tensor, point_b: Tensor, time: Tensor | None = None) -> list[Tensor]:
        """Points of the bodies, as they follow from poses, scales and velocities."""
        points = []
        for point, (rotation, translation), scale, velocity in zip((point_a, point_b), self.parts, self.scales, self.velocities):
            point = torch.nan_to_num(point)
            if time is not None:
                w = velocity[:, 3:] * time[:, None]
                zero = torch.zeros_like(w[:, 0])
                cross = torch.stack([zero, -w[:, 2], w[:, 1], w[:, 2], zero, -w[:, 0], -w[:, 1], w[:, 0], zero], -1)
                rotation = torch.linalg.matrix_exp(cross.reshape(-1, 3, 3)) @ rotation
                translation = translation + velocity[:, :3] * time[:, None]
            points.append(_moved(point, rotation, translation, scale))
        return points

    def result(self, rows: Tensor) -> Tensor:
        return rows.reshape(self.shape).to(self.device, self.dtype)


def _moved(point: Tensor, rotation: Tensor, translation: Tensor, scale: Tensor | None = None) -> Tensor:
    """Points of the world [N, 3] as they follow from the poses and scales of the body that has them."""
    with torch.no_grad():
        local = (rotation.mT @ (point - translation)[..., None])[..., 0]
        if scale is not None:
            local = local / scale[:, None]
    if scale is not None:
        local = local * scale[:, None]
    return (rotation @ local[..., None])[..., 0] + translation


def _tensor(array: Any) -> Tensor:
    return torch.from_numpy(array)


def _parts(name: str, pose: Tensor) -> tuple[Tensor, Tensor]:
    """Rotations [..., 3, 3] and translations [..., 3] of poses, float64."""
    pose = pose.double()
    if pose.ndim >= 2 and pose.shape[-2:] == (4, 4):
        rotation = pose[..., :3, :3]
        with torch.no_grad():
            deviation = (rotation.mT @ rotation - torch.eye(3, dtype=torch.float64, device=pose.device)).abs()
            if not bool((deviation <= 1e-6).all() and (torch.linalg.det(rotation) > 0).all()):
                raise ValueError(f"{name}: a matrix that deforms or mirrors; expected a rotation, up to 1e-6, and a translation")
        return rotation, pose[..., :3, 3]
    if pose.ndim == 0 or pose.shape[-1] != 7:
        raise ValueError(f"{name}: a tensor of shape {tuple(pose.shape)}; expected shape (..., 7), x y z qx qy qz qw, or (..., 4, 4)")
    length = torch.linalg.vector_norm(pose[..., 3:], dim=-1, keepdim=True)
    if not bool((length > 0).all() and pose.isfinite().all()):
        raise ValueError(f"{name}: a quaternion of length 0, or a number that is not finite; expected a rotation")
    x, y, z, w = (pose[..., 3:] / length).unbind(-1)
    rows = [
        1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
        2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
        2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip
    return torch.stack(rows, -1).reshape(*pose.shape[:-1], 3, 3), pose[..., :3]
