"""Collisions and distances among named bodies, by the methods of `trimesh.collision.CollisionManager`."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._native import Scene, asset_of
from .shapes import SIMPLE, Box, Capsule, Cylinder, Plane, Sphere

if TYPE_CHECKING:
    from .bodies import Body

_Array = npt.NDArray[np.float64]

# The name of the body of `in_collision_single` and `min_distance_single` in their data, as trimesh has it.
EXTERNAL = "__external"


class ContactData:
    """A contact of two bodies."""

    def __init__(self, names: tuple[str, str], row: Any) -> None:
        self.names = set(names)
        self._faces = dict(zip(names, (int(row.face_a), int(row.face_b))))
        self._row = row

    @property
    def normal(self) -> _Array:
        """[3] unit normal, from the second body to the first one of the contact"""
        return np.asarray(self._row.normal)

    @property
    def point(self) -> _Array:
        """[3] deepest point of the face"""
        return np.asarray(self._row.point_a)

    @property
    def depth(self) -> float:
        """how deep it is in the other body, 0 or more"""
        return -float(self._row.distance)

    def index(self, name: str) -> int:
        """The face of the body with this name."""
        return self._faces[name]


class DistanceData:
    """The closest points of two bodies; where they overlap, the deepest one and that of the other surface."""

    def __init__(self, names: tuple[str, str], row: Any) -> None:
        self.names = set(names)
        self._faces = dict(zip(names, (int(row.face_a), int(row.face_b))))
        self._points = dict(zip(names, (row.point_a, row.point_b)))
        self._distance = float(row.distance)

    @property
    def distance(self) -> float:
        """signed distance, negative where the bodies overlap"""
        return self._distance

    def index(self, name: str) -> int:
        """The face of the body with this name."""
        return self._faces[name]

    def point(self, name: str) -> _Array:
        """The point [3] on the body with this name."""
        return np.asarray(self._points[name])


class CollisionManager:
    """Named bodies, with the methods and answers of `trimesh.collision.CollisionManager`.

    Other than there, bodies are solid and may be of any shape: one that is inside of another one is in
    collision with it, and distances are exact, and negative where bodies overlap. A body is an asset, a
    simple shape or a mesh, as in `tesdf.collide`; a mesh is encoded once. Poses are matrices [4, 4] or
    seven numbers.
    """

    def __init__(self) -> None:
        self._scene = Scene()
        # The instance and the bounds in its own frame, by name.
        self._bodies: dict[str, tuple[int, _Array]] = {}

    def add_object(self, name: str, mesh: Body, transform: npt.ArrayLike | None = None) -> None:
        """Adds a body, or replaces the one of this name."""
        shape = mesh if isinstance(mesh, SIMPLE) else asset_of(mesh)
        added = self._scene.add(self._scene.add_shape(shape), transform)
        if name in self._bodies:
            self.remove_object(name)
        self._bodies[name] = added, _bounds(shape)

    def remove_object(self, name: str) -> None:
        """Removes a body. Raises ValueError if there is none of this name."""
        instance = self._instance(name)
        instances = self._scene.instances
        shape = int(instances.shape[instances.ids == instance][0])
        self._scene.remove([instance])
        self._scene.remove_shape(shape)
        del self._bodies[name]

    def set_transform(self, name: str, transform: npt.ArrayLike) -> None:
        """Puts a body elsewhere. Raises ValueError if there is none of this name."""
        self._scene.update([self._instance(name)], poses=np.asarray(transform)[None])

    def in_collision_single(
        self, mesh: Body, transform: npt.ArrayLike | None = None, return_names: bool = False, return_data: bool = False
    ) -> Any:
        """Whether a body touches or overlaps one of the manager; with it the set of their names, and a list
        of `ContactData`."""
        single = CollisionManager()
        single.add_object(EXTERNAL, mesh, transform)
        found, pairs, data = self.in_collision_other(single, return_names=True, return_data=True)
        return _answer(found, return_names, {name for name, _ in pairs}, return_data, data)

    def in_collision_internal(self, return_names: bool = False, return_data: bool = False) -> Any:
        """Whether two bodies of the manager touch or overlap; with it the set of pairs of their names, each in
        alphabetical order, and a list of `ContactData`."""
        names = {instance: name for name, (instance, _) in self._bodies.items()}
        pairs, data = _contacts(self._scene, names, return_data)
        return _answer(bool(pairs), return_names, {(min(pair), max(pair)) for pair in pairs}, return_data, data)

    def in_collision_other(self, other_manager: CollisionManager, return_names: bool = False, return_data: bool = False) -> Any:
        """As `in_collision_internal`, of one body of each manager. In pairs, the first name is of this one."""
        scene, others = self._with(other_manager)
        # Bodies of one manager do not meet.
        own = [instance for instance, _ in self._bodies.values()]
        scene.update(own, memberships=1, filter=2)
        scene.update(list(others), memberships=2, filter=1)
        # Names may be in both managers.
        names: dict[int, Any] = {instance: (0, name) for name, (instance, _) in self._bodies.items()}
        names.update({instance: (1, name) for instance, name in others.items()})
        pairs, data = _contacts(scene, names, return_data)
        return _answer(bool(pairs), return_names, {(min(pair)[1], max(pair)[1]) for pair in pairs}, return_data, data)

    def min_distance_single(
        self, mesh: Body, transform: npt.ArrayLike | None = None, return_name: bool = False, return_data: bool = False
    ) -> Any:
        """The signed distance of a body from the nearest one of the manager; with it the name of that one, and
        a `DistanceData`."""
        single = CollisionManager()
        single.add_object(EXTERNAL, mesh, transform)
        distance, names, data = self.min_distance_other(single, return_names=True, return_data=True)
        return _answer(distance, return_name, names[0], return_data, data)

    def min_distance_internal(self, name: str | None = None, return_names: bool = False, return_data: bool = False) -> Any:
        """The least signed distance between two bodies of the manager, or between that of a name and another one;
        with it the two names, and a `DistanceData`."""
        listed = list(self._bodies.items())
        if name is not None:
            self._instance(name)
        pairs = [(a, b) for k, a in enumerate(listed) for b in listed[k + 1 :] if name is None or name in (a[0], b[0])]
        return _least(self._scene, pairs, return_names, return_data)

    def min_distance_other(self, other_manager: CollisionManager, return_names: bool = False, return_data: bool = False) -> Any:
        """As `min_distance_internal`, of one body of each manager. The first name is of this one."""
        scene, others = self._with(other_manager)
        theirs = [(name, (instance, other_manager._bodies[name][1])) for instance, name in others.items()]
        pairs = [(a, b) for a in self._bodies.items() for b in theirs]
        return _least(scene, pairs, return_names, return_data)

    def __len__(self) -> int:
        return len(self._bodies)

    def _instance(self, name: str) -> int:
        if name not in self._bodies:
            raise ValueError(f"{name} is not in the collision manager")
        return self._bodies[name][0]

    def _with(self, other: CollisionManager) -> tuple[Scene, dict[int, str]]:
        """A scene with the bodies of both, and the names of the other one's instances in it."""
        scene, shapes, instances = copy.copy(self._scene), other._scene.shapes, other._scene.instances
        place = {int(instance): row for row, instance in enumerate(instances.ids)}
        added = {}
        for name, (instance, _) in other._bodies.items():
            row = place[instance]
            added[scene.add(scene.add_shape(shapes[int(instances.shape[row])]), instances.poses[row])] = name
        return scene, added


def _answer(first: Any, with_names: bool, names: Any, with_data: bool, data: Any) -> Any:
    more = ([names] if with_names else []) + ([data] if with_data else [])
    return (first, *more) if more else first


def _contacts(scene: Scene, names: dict[int, Any], with_data: bool) -> tuple[set[tuple[Any, Any]], list[ContactData]]:
    """The pairs of names of bodies that touch or overlap, and their contacts."""
    found = scene.detect() if with_data else scene.detect(reduce=1)
    found = found[found.distance <= 0]
    both = np.concatenate([np.stack([of.instance_a, of.instance_b], 1) for of in (found, found.hidden)])
    pairs = {(names[a], names[b]) for a, b in np.unique(np.sort(both, 1), axis=0).tolist()}
    plain = {instance: name if isinstance(name, str) else name[1] for instance, name in names.items()}
    data = [ContactData((plain[int(row.instance_a)], plain[int(row.instance_b)]), row) for row in found] if with_data else []
    return pairs, data


def _least(scene: Scene, pairs: list[Any], with_names: bool, with_data: bool) -> Any:
    """The pair with the least clearance: the pairs are searched in the order of their boxes' distances."""
    if not pairs:
        raise ValueError("there are no two bodies between which a distance could be")
    instances = scene.instances
    place = {int(instance): pose for instance, pose in zip(instances.ids, instances.poses)}
    spheres = [[_sphere(place[instance], bounds) for _, (instance, bounds) in pair] for pair in pairs]
    bounds = np.array([np.linalg.norm(a[0] - b[0]) - a[1] - b[1] if np.isfinite(a[1] + b[1]) else -np.inf for a, b in spheres])
    order, best, least = np.argsort(bounds, kind="stable"), None, np.inf
    for start in range(0, len(order), 16):
        chosen = order[start : start + 16]
        chosen = chosen[bounds[chosen] <= least]
        if not len(chosen):
            break
        found = scene.clearances([[body[1][0] for body in pairs[k]] for k in chosen])
        row = int(found.distance.argmin())
        if found.distance[row] < least:
            least, best = float(found.distance[row]), (tuple(body[0] for body in pairs[chosen[row]]), found[row])
    assert best is not None
    return _answer(least, with_names, best[0], with_data, DistanceData(*best))


def _bounds(shape: Any) -> _Array:
    if isinstance(shape, Plane):
        return np.array([[-np.inf] * 3, [np.inf] * 3])
    if isinstance(shape, Box):
        return np.array([-1, 1])[:, None] * np.asarray(shape.half_extents)
    if isinstance(shape, Cylinder):
        high = np.array([shape.radius, shape.radius, shape.half_height])
        return np.stack([-high, high])
    if isinstance(shape, (Sphere, Capsule)):
        high = shape.radius + np.array([0, 0, shape.half_height if isinstance(shape, Capsule) else 0])
        return np.stack([-high, high])
    return np.asarray(shape.bounds)


def _sphere(pose: _Array, bounds: _Array) -> tuple[_Array, float]:
    """The centre and radius of a sphere around the bounds, in the world."""
    if not np.isfinite(bounds).all():
        return np.zeros(3), np.inf
    middle, (v, w) = bounds.mean(0), (pose[3:6], pose[6])
    turned = middle + 2 * np.cross(v, np.cross(v, middle) + w * middle)
    return pose[:3] + turned, float(np.linalg.norm(bounds[1] - bounds[0]) / 2)
