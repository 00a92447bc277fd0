"""Files that play runs."""

from __future__ import annotations

import html
import tempfile
import webbrowser
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Union

from . import _native
from .contacts import Record
from .errors import SimulationError

_Path = Union[str, "PathLike[str]"]

# Notebooks keep what they show, so a page in one has fewer states than a file, no contacts, and at
# most this many bytes.
_NOTEBOOK_FRAMES = 300
_NOTEBOOK_BYTES = 8_000_000


@dataclass(frozen=True)
class LiveView:
    """A page on this machine that follows the steps of a simulation: `Simulation.view`.

    A notebook on the same machine shows it as the value of a cell.
    """

    url: str
    """its address, such as http://127.0.0.1:41234/"""

    def open(self) -> None:
        """Opens the page in the browser of the user. Raises RuntimeError where none can be started."""
        if not webbrowser.open(self.url):
            raise RuntimeError(f"no browser can be started here; open {self.url} in one on this machine")

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" width="100%" height="520" style="border: 0"></iframe>'


def _of_notebook(run: _native.Simulation | Record, name: str = "simulation") -> str:
    """What a notebook shows of a simulation or its record: the page of `view`, or where it would be too
    large or there are no states, what to call instead."""
    said = html.escape(repr(run))
    steps = len(run) - 1 if isinstance(run, Record) else run.steps
    every = max(1, -(-steps // _NOTEBOOK_FRAMES))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "page.html")
        try:
            _native.view(run, path, every=every, contacts=0, title=name)
        except SimulationError as error:
            return f"<p>{said}</p><p>{html.escape(str(error))}; <code>view()</code> shows the steps to come</p>"
        size = path.stat().st_size
        page = path.read_text(encoding="utf-8") if size <= _NOTEBOOK_BYTES else None
    if page is None:
        return f'<p>{said}</p><p>{size / 1e6:.0f} MB to play: <code>tesdf.view({name}, "page.html")</code></p>'
    # Scripts of the page see nothing of the notebook.
    return (
        f'<iframe srcdoc="{html.escape(page)}" sandbox="allow-scripts" width="100%" height="520" '
        'style="border: 0"></iframe>'
    )


def export(
    run: _Path | _native.Simulation | Record,
    path: _Path,
    *,
    every: int | None = None,
    fps: float | None = None,
    speed: float = 1.0,
    geometries: Mapping[str, _Path] | None = None,
) -> None:
    """Writes a run as an animation: a GLB file, which Blender, three.js and others play, or, if the path
    ends with .rrd, a recording for the viewer of rerun.

    - run: the path of a run of `tesdf simulate` or Simulation.save, a Simulation, whose steps so far
      are taken, or a Record.
    - path: the file.
    - every: every N-th step and the last one are played. fps: the steps nearest to this many times
      in each second of the run. Without both, at most 1000 steps are.
    - speed: seconds of the run in each second of the animation. Not for .rrd, whose viewer has a
      control of the speed.
    - geometries: files in place of the meshes that the run names: a dict of names of bodies and
      paths; "link*" are all bodies whose names begin with "link". Not for a Simulation or Record, which has its meshes.

    Each body is a node or an entity with its name; lengths are metres. In a GLB file y is up, as glTF
    wants it, and the same run gives the bytes of `tesdf export`. A recording has the frame of the
    scene and the timeline "time"; it needs the package rerun-sdk. Neither has contacts.

    Raises OSError if a file cannot be read or written, SceneError if a mesh is missing, SimulationError
    if the run cannot be played, and ImportError without rerun-sdk.
    """
    if Path(path).suffix.lower() != ".rrd":
        _native.export(run, path, every=every, fps=fps, speed=speed, geometries=geometries)
        return
    if speed != 1.0:
        raise ValueError(f"speed: {speed}; expected 1 for a .rrd file, as the viewer of rerun has a control of the speed")
    from ._rerun import Animation, write

    with tempfile.TemporaryDirectory() as folder:
        glb = Path(folder, "run.glb")
        _native.export(run, glb, every=every, fps=fps, geometries=geometries)
        write(Animation(glb.read_bytes()), Path(path))
