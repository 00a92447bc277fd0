"""Scenes of simulations that are built in code."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any


def to_json(scene: Mapping[str, Any]) -> str:
    """The text of a scene with the keys of a scene file. Arrays of numpy become lists, and paths text."""
    return json.dumps(scene, default=_plain)


def _plain(value: Any) -> Any:
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"scene: a value of type {type(value).__name__}; expected numbers, text, lists, dicts, arrays or paths")
