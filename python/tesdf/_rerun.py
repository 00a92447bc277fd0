"""Recordings for the viewer of rerun, from the GLB file of a run."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

try:
    import rerun as rr  # type: ignore[import-not-found, unused-ignore]
except ImportError:
    raise ImportError("a .rrd file needs the package rerun-sdk: pip install rerun-sdk") from None

_KINDS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


class Animation:
    """A GLB file of `_native.export`: its nodes, meshes and keyframes."""

    def __init__(self, glb: bytes) -> None:
        length = struct.unpack_from("<I", glb, 12)[0]
        self.json: dict[str, Any] = json.loads(glb[20 : 20 + length])
        self._numbers = glb[28 + length :]
        self.tracks: dict[tuple[int, str], tuple[npt.NDArray[Any], npt.NDArray[Any]]] = {}
        for animation in self.json.get("animations", ()):
            for channel in animation["channels"]:
                sampler, target = animation["samplers"][channel["sampler"]], channel["target"]
                keys = self.array(sampler["input"])[:, 0], self.array(sampler["output"])
                self.tracks[target["node"], target["path"]] = keys

    def array(self, accessor: int) -> npt.NDArray[Any]:
        """[N, W] numbers."""
        given = self.json["accessors"][accessor]
        view = self.json["bufferViews"][given["bufferView"]]
        width = _WIDTHS[given["type"]]
        start = view.get("byteOffset", 0) + given.get("byteOffset", 0)
        kind = np.dtype(_KINDS[given["componentType"]])
        stride = view.get("byteStride", width * kind.itemsize)
        return np.ndarray((given["count"], width), kind, self._numbers, start, (stride, kind.itemsize))


def write(animation: Animation, path: Path) -> None:
    """Writes a recording of the bodies in the frame of the scene."""
    recording = rr.RecordingStream("tesdf")
    recording.save(path)
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    [root] = animation.json["scenes"][0]["nodes"]
    for node in animation.json["nodes"][root]["children"]:
        _log(recording, animation, node, "run")
    # The node of the run turns z upwards to y; here z stays upwards.
    centre = _turned_back(animation.json["nodes"][root])
    recording.log("run", rr.Transform3D(translation=centre), static=True)
    recording.flush()
    recording.disconnect()


def _turned_back(root: dict[str, Any]) -> list[float]:
    x, y, z = root.get("translation", [0.0, 0.0, 0.0])
    return [x, -z, y]


def _log(recording: rr.RecordingStream, animation: Animation, number: int, parent: str) -> None:
    node = animation.json["nodes"][number]
    path = f"{parent}/{rr.escape_entity_path_part(node.get('name', str(number)))}"
    fixed = {"translation": "translation", "rotation": "quaternion", "scale": "scale"}
    moving = {"translation": "translation", "rotation": "quaternion"}
    still = {to: node[key] for key, to in fixed.items() if key in node and (number, key) not in animation.tracks}
    if still:
        recording.log(path, rr.Transform3D.from_fields(**still), static=True)
    for key, to in moving.items():
        if (number, key) in animation.tracks:
            times, values = animation.tracks[number, key]
            named: dict[str, Any] = {to: values}
            columns = rr.Transform3D.columns(**named)
            rr.send_columns(path, [rr.TimeColumn("time", duration=times.astype(float))], columns, recording=recording)
    if "mesh" in node:
        for part, primitive in enumerate(animation.json["meshes"][node["mesh"]]["primitives"]):
            _log_mesh(recording, animation, primitive, f"{path}/mesh_{part}")
    for child in node.get("children", ()):
        _log(recording, animation, child, path)


def _log_mesh(recording: rr.RecordingStream, animation: Animation, primitive: dict[str, Any], path: str) -> None:
    attributes = primitive["attributes"]
    material = animation.json["materials"][primitive["material"]]["pbrMetallicRoughness"]
    linear = np.array(material.get("baseColorFactor", [1, 1, 1, 1]))
    # rerun wants colours of sRGB.
    colour = np.where(linear < 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055)
    mesh = rr.Mesh3D(
        vertex_positions=animation.array(attributes["POSITION"]),
        vertex_normals=animation.array(attributes["NORMAL"]) if "NORMAL" in attributes else None,
        triangle_indices=animation.array(primitive["indices"]).reshape(-1, 3),
        albedo_factor=[*(round(255 * c) for c in colour[:3]), 255],
    )
    recording.log(path, mesh, static=True)
