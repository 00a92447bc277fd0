"""Contacts of tesdf in Newton, in place of its own contacts between meshes.

    pipeline = newton.CollisionPipeline(model, rigid_contact_max=20_000, speculative_contact_gap_max=1e-3)
    pipeline.narrow_phase = tesdf.newton.NarrowPhase(pipeline, {"bolt": bolt, "nut": nut})
    contacts = pipeline.contacts()
    pipeline.collide(state, contacts, dt=h)         # as without tesdf

It needs the package `newton`, 1.8 or newer. Contacts are found on the processor, or with device="cuda:0" on a GPU:
where Newton runs on the same one, poses and contacts stay there.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

try:
    import newton as nt  # type: ignore[import-not-found, unused-ignore]
    import warp as wp
except ImportError:
    raise ImportError("tesdf.newton needs the package newton: pip install 'newton[sim]>=1.8'") from None

from . import Asset, Contacts as Found, DeviceContacts, Scene
from ._coupling import RIGID_SOLIMP, Detector, Float, Placed, check_bounds, rigid_solref
from ._newton_kernels import meet, place, write
from ._warp import Memory, cuda_number, in_place

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .bodies import DetectOptions

_IDENTITY = np.array([0.0, 0, 0, 0, 0, 0, 1])


class NarrowPhase(nt.geometry.NarrowPhase):  # type: ignore[misc, unused-ignore]
    """The narrow phase of a pipeline, with contacts of tesdf between meshes that have an asset.

    assets: for the labels of mesh shapes, the assets that were encoded from the same vertices. A label
    also stands for "prefix/label", and for the shapes of this label in all worlds. Other pairs, such
    as a mesh and the ground, are left to Newton.

    The remaining keywords are those of `Scene.detect`. The default mode is "node", the vertices of
    each body in the field of the other; coarse meshes need "exact". The contact distance is 0.5 % of
    the smallest diagonal of an asset if it is not given. In a pipeline with
    `speculative_contact_gap_max`, what motion can close within 1.2 of collide's `dt` comes to it. Shapes
    with a margin need a contact distance above the sum of their margins.

    Newton's broad phase decides which shapes meet: its groups, filters and worlds hold, and shapes
    that are farther apart than their gaps, and what it adds for motion, have no contacts.

    Contacts that do not fit the pipeline's `rigid_contact_max` are a ValueError. The pipeline cannot
    be deterministic, match contacts from step to step, or be captured in a CUDA graph.
    """

    def __init__(
        self, pipeline: nt.CollisionPipeline, assets: Mapping[str, Asset], **options: Unpack[DetectOptions]
    ) -> None:
        if pipeline.deterministic:
            raise ValueError(
                "the pipeline is deterministic or matches contacts, which needs keys of Newton; switch both off"
            )
        # What the pipeline has built, buffers included; Newton's own tests extend it in this way.
        self.__dict__ = pipeline.narrow_phase.__dict__
        model = pipeline.model
        chosen = [(number, assets[name]) for number, name in _named(model.shape_label, assets)]
        if not chosen:
            raise ValueError("assets is empty; give the asset of at least one mesh shape")
        placed = {number: _placed(model, number, asset) for number, asset in chosen}
        numbers = np.array(list(placed))
        worlds, bodies = model.shape_world.numpy()[numbers], model.shape_body.numpy()[numbers]
        # A shape of all worlds (-1) is an instance in each of them.
        each = np.unique(worlds[worlds >= 0]) if (worlds >= 0).any() else np.zeros(1, int)
        rows = [np.flatnonzero((worlds == world) | (worlds < 0)) for world in each]
        of_instances = np.concatenate(rows)
        excluded, start = [], 0
        for inside in rows:
            a, b = np.triu_indices(len(inside), 1)
            of_all = worlds[inside] < 0
            # Two shapes of all worlds meet in the first one only.
            still = (bodies[inside][a] == bodies[inside][b]) | (of_all[a] & of_all[b] & (start > 0))
            excluded.append(np.stack([a, b], 1)[still] + start)
            start += len(inside)
        self._tesdf_instances = numbers[of_instances]
        """the shape of each instance"""
        self._tesdf_has_asset = np.isin(np.arange(model.shape_count), numbers)
        self._tesdf_others = False
        """whether there have been pairs for Newton"""
        self._tesdf_margins = model.shape_margin.numpy().astype(np.float64)
        self._tesdf_detector = Detector(
            [placed[number] for number in self._tesdf_instances],
            np.repeat(each, [len(inside) for inside in rows]),
            np.concatenate(excluded),
            options,
        )

    @property
    def last(self) -> Found | DeviceContacts | None:
        """The contacts of the last detection, None before the first; `DeviceContacts` where they stay on a GPU.
        `shapes` has the shape of each instance."""
        there = self._tesdf_detector.last_on_device
        return self._tesdf_detector.last if there is None else there

    @property
    def shapes(self) -> npt.NDArray[np.int64]:
        """[N] the shape in Newton's model of each instance"""
        return self._tesdf_instances.copy()

    @property
    def scene(self) -> Scene:
        """A copy of the scene, at the poses of the last detection."""
        return self._tesdf_detector.scene_now()

    def launch_custom_write(self, **arguments: Any) -> None:
        """Called by the pipeline. Finds the contacts of the candidate pairs."""
        given, device = arguments["candidate_pair"], arguments["candidate_pair"].device
        pairs = given.numpy()[: int(arguments["candidate_pair_count"].numpy()[0])]
        ours = self._tesdf_has_asset[pairs].all(axis=1)
        # Without other pairs, Newton's kernels are not even compiled. After its first call it needs all
        # others, as it sets back its counters in them.
        if self._tesdf_others or not ours.all():
            self._tesdf_others = True
            rest = wp.zeros_like(given)
            _put(rest, 0, pairs[~ours])
            arguments["candidate_pair"] = rest
            arguments["candidate_pair_count"] = wp.array([int((~ours).sum())], dtype=wp.int32, device=device)
            super().launch_custom_write(**arguments)
        if ours.any():
            out = arguments["writer_data"]
            if self._tesdf_detector.leaves_on(cuda_number(device)):
                self._tesdf_write_there(self._tesdf_detect_there(arguments), pairs[ours], out)
            else:
                self._tesdf_write(self._tesdf_detect(arguments), pairs[ours], out)

    def _tesdf_detect(self, arguments: dict[str, Any]) -> Found:
        transforms = arguments["shape_transform"].numpy()[self._tesdf_instances].astype(np.float64)
        still = np.zeros((len(transforms), 3))
        linear, angular = (
            still if (array := arguments.get(name)) is None else array.numpy()[self._tesdf_instances].astype(np.float64)
            for name in ("shape_linear_velocity", "shape_angular_velocity")
        )
        step = arguments.get("collision_update_dt", 0.0)
        return self._tesdf_detector.detect(_rotations(transforms), transforms[:, :3], linear, angular, step)

    def _tesdf_write(self, found: Found, pairs: npt.NDArray[Any], out: Any) -> None:
        # Newton's normal points from shape 0 to shape 1.
        shapes = self._tesdf_instances[np.stack([found.instance_b, found.instance_a], 1)]
        keys = np.sort(shapes, axis=1) @ [len(self._tesdf_has_asset), 1]
        meets = np.isin(keys, np.sort(pairs, axis=1) @ [len(self._tesdf_has_asset), 1])
        shapes, normal = shapes[meets], found.normal[meets]
        points = found.point_b[meets], found.point_a[meets]
        rows = len(shapes)
        first = _room(out, rows)
        body_q, bodies = out.body_q.numpy().astype(np.float64).reshape(-1, 7), out.shape_body.numpy()
        margins = self._tesdf_margins[shapes]
        for side, sign in ((0, 1.0), (1, -1.0)):
            body = bodies[shapes[:, side]]
            frame = np.where((body >= 0)[:, None], np.vstack([body_q, _IDENTITY])[body], _IDENTITY)
            axes, margin = _rotations(frame), margins[:, side]
            local = np.einsum("nji,nj->ni", axes, points[side] - frame[:, :3])
            offset = np.einsum("nji,nj->ni", axes, sign * margin[:, None] * normal)
            _put(getattr(out, f"out_shape{side}"), first, shapes[:, side])
            _put(getattr(out, f"out_point{side}"), first, local)
            _put(getattr(out, f"out_offset{side}"), first, offset)
            _put(getattr(out, f"out_margin{side}"), first, margin)
        _put(out.out_normal, first, normal)
        _finish(out, first, rows)

    def _tesdf_detect_there(self, arguments: dict[str, Any]) -> DeviceContacts:
        """As `_tesdf_detect`, where Newton has its arrays."""
        transforms = arguments["shape_transform"]
        here, count = transforms.device, len(self._tesdf_instances)
        velocities = [arguments.get(name) for name in ("shape_linear_velocity", "shape_angular_velocity")]
        of_poses, of_velocities = (wp.zeros((count, columns), dtype=float, device=here) for columns in (7, 6))
        self._tesdf_there: Any = wp.array(self._tesdf_instances, dtype=wp.int32, device=here)
        inputs = [self._tesdf_there, transforms, *velocities]
        wp.launch(place, dim=count, inputs=inputs, outputs=[of_poses, of_velocities], device=here)
        # tesdf works in a stream of its own, which does not wait for Warp's.
        wp.synchronize_device(here)
        step = arguments.get("collision_update_dt", 0.0)
        return self._tesdf_detector.detect_on_device(Memory(of_poses), Memory(of_velocities), step)

    def _tesdf_write_there(self, found: DeviceContacts, pairs: npt.NDArray[Any], out: Any) -> None:
        here, count, shapes = out.contact_count.device, len(found), len(self._tesdf_has_asset)
        if count == 0:
            return
        keys = np.unique(np.sort(pairs, axis=1).astype(np.int64) @ np.array([shapes, 1]))
        instances = in_place(found.instances, wp.vec2i, here)
        meets, places = (wp.zeros(count, dtype=wp.int32, device=here) for _ in range(2))
        inputs = [self._tesdf_there, shapes, wp.array(keys, dtype=wp.int64, device=here), instances]
        wp.launch(meet, dim=count, inputs=inputs, outputs=[meets], device=here)
        wp.utils.array_scan(meets, places, inclusive=True)
        rows = int(places[count - 1 :].numpy()[0])
        first = _room(out, rows)
        margins: Any = wp.array(self._tesdf_margins, dtype=float, device=here)
        points = [in_place(array, wp.vec3, here) for array in (found.point_a, found.point_b, found.normal)]
        wp.launch(
            write,
            dim=count,
            inputs=[first, self._tesdf_there, margins, out.body_q, out.shape_body, meets, places, *points, instances],
            outputs=[
                *(getattr(out, f"out_{name}{side}") for name in ("shape", "point", "offset", "margin") for side in (0, 1)),
                out.out_normal,
            ],
            device=here,
        )
        _finish(out, first, rows)


def _room(out: Any, rows: int) -> int:
    """The number of contacts that are there, after which there is room for some rows."""
    first = int(out.contact_count.numpy()[0])
    if first + rows > out.contact_max:
        raise ValueError(
            f"{first + rows} contacts, but the pipeline has room for {out.contact_max}; give CollisionPipeline "
            f"rigid_contact_max={int(1.3 * (first + rows))}, or reduce the contacts, as reduce=64"
        )
    return first


def _finish(out: Any, first: int, rows: int) -> None:
    """Fills what is zero for all of our contacts, where the pipeline uses it, and counts them."""
    for name in ("out_tids", "out_stiffness", "out_damping", "out_friction"):
        target = getattr(out, name)
        if rows and target is not None and target.size:
            target[first : first + rows].fill_(0)
    out.contact_count.fill_(first + rows)


def rigid(time_step: float) -> dict[str, Any]:
    """Attributes of a shape with which an overlap of one time step is gone in the next, for
    `SolverMuJoCo`: custom_attributes=tesdf.newton.rigid(h) in `add_shape_mesh`.

    The solref is (-d / h^2, -d / h) with the impedance d = 0.9, that of `tesdf.mujoco`. It needs
    `SolverMuJoCo.register_custom_attributes(builder)`, and holds for the time step of `solver.step`.
    """
    if not time_step > 0:
        raise ValueError(f"time_step: {time_step}; expected more than 0")
    return {
        "mujoco:solref": tuple(rigid_solref(np.array(time_step)).tolist()),
        "mujoco:solref_mode": 1,  # as given, rather than from stiffness and damping of the material
        "mujoco:geom_solimp": RIGID_SOLIMP,
    }


def _named(labels: list[str], assets: Mapping[str, Asset]) -> list[tuple[int, str]]:
    found = [
        (number, name)
        for name in assets
        for number, label in enumerate(labels)
        if label == name or label.endswith("/" + name)
    ]
    for name in assets:
        if name not in {each for _, each in found}:
            raise ValueError(f"there is no shape {name!r}; the labels are {sorted(set(labels))}")
    return found


def _placed(model: nt.Model, number: int, asset: Asset) -> Placed:
    label, mesh = model.shape_label[number], model.shape_source[number]
    kind = nt.GeoType(int(model.shape_type.numpy()[number]))
    if kind != nt.GeoType.MESH:
        raise ValueError(f"shape {label!r} is a {kind.name.lower()}; an asset needs a mesh shape")
    scales = model.shape_scale.numpy()[number].astype(np.float64)
    if not (scales > 0).all() or np.ptp(scales) > 1e-6 * scales[0]:
        raise ValueError(f"shape {label!r}: its scale is {scales}; expected one positive number three times")
    vertices = np.asarray(mesh.vertices, dtype=np.float64).reshape(-1, 3)
    of_mesh = np.array([vertices.min(axis=0), vertices.max(axis=0)])
    check_bounds(f"shape {label!r}", of_mesh, asset.bounds, "encode the vertices of the mesh")
    return Placed(asset, float(scales[0]), np.eye(3), np.zeros(3))


def _rotations(transforms: Float) -> Float:
    """[N, 3, 3], of x y z qx qy qz qw."""
    quaternions = transforms[:, 3:]
    x, y, z, w = (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _put(target: Any, first: int, rows: npt.NDArray[Any]) -> None:
    """Copies rows to an array of Newton, which is empty or None if the pipeline does not use it."""
    if len(rows) and target is not None and target.size:
        kind = np.int32 if target.dtype in (wp.int32, wp.vec2i) else np.float32
        source: Any = wp.array(np.ascontiguousarray(rows, kind), dtype=target.dtype, device="cpu")
        wp.copy(target, source, dest_offset=first, count=len(rows))
