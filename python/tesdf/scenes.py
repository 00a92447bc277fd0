"""Scenes of simulations that are built in code."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

from . import _native
from .shapes import SIMPLE, Box, Capsule, Cylinder, Plane, Sphere

_GEOMETRY = ("asset", "mesh", "shape")


def to_json(scene: Mapping[str, Any]) -> tuple[str, dict[str, _native.Asset]]:
    """The text of a scene with the keys of a scene file, and the assets that its bodies name.

    Arrays of numpy become lists, paths text, and objects of shapes their keys.
    """
    memory = _Memory()
    bodies = scene.get("bodies")
    if isinstance(bodies, (list, tuple)):
        scene = {**scene, "bodies": [_body(k, body, memory) for k, body in enumerate(bodies)]}
    return json.dumps(scene, default=_plain), memory.assets


class _Memory:
    """Assets by the names that stand for them in the scene. Bodies share what is the same object."""

    def __init__(self) -> None:
        self.assets: dict[str, _native.Asset] = {}
        self._names: dict[Any, str] = {}
        self._kept: list[Any] = []

    def name(self, key: Any, kept: Any, asset: Any) -> str:
        if key not in self._names:
            # An object that goes away could leave its id to another one.
            self._kept.append(kept)
            self._names[key] = f"<memory>/{len(self._names)}.tesdf"
            self.assets[self._names[key]] = asset()
        return self._names[key]


def _body(k: int, body: Any, memory: _Memory) -> Any:
    if not isinstance(body, Mapping):
        return body
    body = dict(body)
    where = f"bodies: entry {k}"
    for key in _GEOMETRY:
        value = body.get(key)
        if value is None or isinstance(value, (str, os.PathLike, Mapping)):
            continue
        del body[key]
        if isinstance(value, SIMPLE):
            body["shape"] = _shape(value)
        elif isinstance(value, _native.Asset):
            body["asset"] = memory.name(id(value), value, lambda: value)
        else:
            keywords = {name: body.pop(name) for name in ("inside", "thickness", "surface") if name in body}
            if body.pop("repair", "never") == "auto":
                keywords["repair"] = "auto"
            choices = json.dumps(keywords, sort_keys=True, default=_plain)
            body["asset"] = memory.name((id(value), choices), value, lambda: _native.encode(value, "fast", **keywords))
    velocity = body.get("velocity")
    if velocity is not None and not isinstance(velocity, str) and len(velocity) == 6:
        if "angular_velocity" in body:
            raise ValueError(f"{where}: velocity: six numbers beside angular_velocity; expected three, or no angular_velocity")
        body["velocity"], body["angular_velocity"] = list(velocity[:3]), list(velocity[3:])
    return body


def _shape(shape: Plane | Box | Sphere | Capsule | Cylinder) -> Any:
    if isinstance(shape, Plane):
        return "plane"
    if isinstance(shape, Box):
        return {"box": {"half_extents": shape.half_extents}}
    if isinstance(shape, Sphere):
        return {"sphere": {"radius": shape.radius}}
    kind = "capsule" if isinstance(shape, Capsule) else "cylinder"
    return {kind: {"half_height": shape.half_height, "radius": shape.radius}}


def _plain(value: Any) -> Any:
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"scene: a value of type {type(value).__name__}; expected numbers, text, lists, dicts, arrays or paths")
