"""Files that play runs."""

from __future__ import annotations

import html
import sys
import tempfile
import webbrowser
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Union

from . import _native
from .contacts import Record
from .errors import SimulationError

_Path = Union[str, "PathLike[str]"]

_Run = Union[_Path, _native.Simulation, Record]

# Notebooks keep what they show, so a page in one has at most this many bytes, and fewer states than a
# file.
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
        _browse(self.url, self.url)

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" width="100%" height="520" style="border: 0"></iframe>'


@dataclass(frozen=True)
class Page:
    """A page that plays a run, which `tesdf.view` has made without a path. A notebook shows it as the value
    of a cell."""

    path: Path | None
    """the temporary file that the browser shows; None in a notebook"""
    _shown: str | None = None

    def __repr__(self) -> str:
        return f"<tesdf.Page: {self.path or 'in a notebook'}>"

    def _repr_html_(self) -> str | None:
        return self._shown


def view(
    run: _Run,
    path: _Path | None = None,
    *,
    every: int | None = None,
    fps: float | None = None,
    contacts: int | None = None,
    title: str | None = None,
    geometries: Mapping[str, _Path] | None = None,
    progress: Callable[[str, float], object] | None = None,
) -> Page | None:
    """Plays a run in a browser, with its contacts: writes a page, one file that needs no server and asks
    for nothing. Ctrl-C ends it with KeyboardInterrupt.

    - run: the path of a run of `tesdf simulate` or Simulation.save, a Simulation, whose steps so far
      are taken, or a Record.
    - path: the file. Without it, the page is a temporary file, and is opened in the browser of the user.
      In a notebook, it is the value that is returned, which the notebook shows; where it has more than
      8 MB, that says what to call instead.
    - every: every N-th step and the last one are played. fps: the steps nearest to this many times
      in each second of the run. Without both, at most 1000 steps are, and in a notebook 300.
    - contacts: at most this many contacts of a frame are drawn, the deepest ones of each place.
      Contacts that the run has not recorded are detected again. None is 128; but in a notebook, only
      contacts that the run has recorded are drawn, where it has those of all frames but the last.
    - title: heading of the page; None is the name of the run.
    - geometries: files in place of the meshes that the run names: a dict of names of bodies and
      paths; "link*" are all bodies whose names begin with "link". Not for a Simulation or Record, which
      has its meshes.
    - progress: called with the stage and the completed fraction of it: "contacts", and before it those
      of `encode`, for each mesh that is not in the cache. An exception that it raises ends the work.

    Returns a Page without a path, and None with one. The same run gives the bytes of `tesdf view`.

    Raises OSError if a file cannot be read or written, SceneError if a mesh is missing, SimulationError
    if the run cannot be played, and RuntimeError where no browser can be started.
    """
    in_notebook = path is None and _is_notebook()
    if contacts is None and not in_notebook:
        contacts = 128

    def write(file: _Path) -> None:
        _native.view(
            run, file, every=every, fps=fps, contacts=contacts, title=title, geometries=geometries,
            progress=progress, in_notebook=in_notebook,
        )  # fmt: skip

    if path is not None:
        write(path)
        return None
    if in_notebook:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "page.html")
            write(file)
            return Page(None, _in_cell(file, repr(run), "run"))
    file = Path(tempfile.mkdtemp(prefix="tesdf-"), "page.html")
    try:
        write(file)
    except BaseException:
        file.parent.rmdir()
        raise
    _browse(file.as_uri(), str(file))
    return Page(file)


def _browse(url: str, name: str) -> None:
    if not webbrowser.open(url):
        raise RuntimeError(f"no browser can be started here; open {name} in one on this machine")


def _is_notebook() -> bool:
    """Whether cells show HTML here. IPython in a terminal has no kernel."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")


def _of_notebook(run: _native.Simulation | Record, name: str = "simulation") -> str:
    """What a notebook shows of a simulation or its record: the page of `view`, or where it would be too
    large or there are no states, what to call instead."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "page.html")
        try:
            _native.view(run, file, title=name, in_notebook=True)
        except SimulationError as error:
            said = f"{html.escape(str(error))}; <code>view()</code> shows the steps to come"
            return f"<p>{html.escape(repr(run))}</p><p>{said}</p>"
        return _in_cell(file, repr(run), name)


def _in_cell(page: Path, said: str, name: str) -> str:
    """A page within a notebook, or where it is too large, what to call instead."""
    size = page.stat().st_size
    if size > _NOTEBOOK_BYTES:
        call = f'tesdf.view({name}, "page.html")'
        return f"<p>{html.escape(said)}</p><p>{size / 1e6:.0f} MB to play: <code>{call}</code></p>"
    # Scripts of the page see nothing of the notebook.
    return (
        f'<iframe srcdoc="{html.escape(page.read_text(encoding="utf-8"))}" sandbox="allow-scripts" width="100%" '
        'height="520" style="border: 0"></iframe>'
    )


def export(
    run: _Run,
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
