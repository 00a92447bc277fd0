"""`tesdf.view` in a browser and in notebooks, which are stand-ins here."""

import html
import re
import sys
import types
import webbrowser
from pathlib import Path

import pytest
import tesdf
from test_simulation import SCENE

UNRECORDED = SCENE.replace("contacts_every = 2\nforces_every = 60", "contacts_every = 0")


@pytest.fixture
def simulated(tmp_path):
    """Runs a scene."""

    def run(scene):
        (tmp_path / "scene.toml").write_text(scene)
        simulation = tesdf.Simulation(tmp_path / "scene.toml")
        simulation.run()
        return simulation

    return run


@pytest.fixture
def browser(monkeypatch, tmp_path):
    """the addresses that a browser has opened; temporary files are in tmp_path"""
    opened = []
    monkeypatch.setattr(webbrowser, "open", lambda url: opened.append(url) or True)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return opened


@pytest.fixture
def notebook(monkeypatch):
    shell = types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))


def page_of(shown):
    source = re.fullmatch(r'<iframe srcdoc="([^"]*)" sandbox="allow-scripts" [^<>]*></iframe>', shown)
    return html.unescape(source[1])


def page(run, path, **options):
    assert tesdf.view(run, path, **options) is None
    return path.read_text(encoding="utf-8")


def temporary(tmp_path):
    return [path.name for path in tmp_path.iterdir() if path.name.startswith("tesdf-")]


def test_a_browser_opens_the_page(simulated, browser, tmp_path):
    simulation = simulated(SCENE)
    shown = tesdf.view(simulation, every=7)
    assert browser == [shown.path.as_uri()] and repr(shown) == f"<tesdf.Page: {shown.path}>"
    assert shown.path.read_text(encoding="utf-8") == page(simulation, tmp_path / "page.html", every=7)
    # IPython in a terminal is no notebook.
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: object()))
        assert tesdf.view(simulation, every=7).path != shown.path
    assert len(browser) == 2


def test_without_a_browser_the_error_names_the_page(simulated, browser, monkeypatch):
    monkeypatch.setattr(webbrowser, "open", lambda url: False)
    with pytest.raises(RuntimeError, match="no browser can be started here; open .*page.html") as caught:
        tesdf.view(simulated(SCENE))
    assert "<html" in Path(re.search(r"open (.*\.html)", str(caught.value))[1]).read_text(encoding="utf-8")


def test_errors_leave_no_file_and_open_nothing(browser, tmp_path):
    with pytest.raises(FileNotFoundError):
        tesdf.view(tmp_path / "none.tesrun")
    (tmp_path / "cube.stl").write_text("solid")
    with pytest.raises(tesdf.SimulationError, match=r"cube.stl: not a run of tesdf.*; Simulation.save writes runs") as caught:
        tesdf.view(tmp_path / "cube.stl")
    assert "tesdf simulate" not in str(caught.value) and "tesdf.simulate" not in str(caught.value)
    assert browser == [] and temporary(tmp_path) == []


def test_a_notebook_shows_the_page(simulated, browser, notebook, tmp_path):
    simulation = simulated(SCENE)
    simulation.save(tmp_path / "drop.tesrun")
    for run in (simulation, simulation.record(), tmp_path / "drop.tesrun"):
        shown = tesdf.view(run, title="drop", fps=100)
        assert shown.path is None and repr(shown) == "<tesdf.Page: in a notebook>"
        # Contacts are recorded at each second step, and frames are at each tenth.
        assert page_of(shown._repr_html_()) == page(run, tmp_path / "page.html", title="drop", fps=100)
    assert browser == [] and temporary(tmp_path) == []


def test_a_notebook_plays_the_steps_with_recorded_contacts(simulated, notebook, tmp_path):
    simulation = simulated(SCENE)
    recorded = page(simulation, tmp_path / "page.html", every=2, title="simulation")
    assert page_of(simulation._repr_html_()) == recorded
    assert page_of(tesdf.view(simulation, title="simulation")._repr_html_()) == recorded
    # Those of other steps would have to be detected.
    bare = page(simulated(UNRECORDED), tmp_path / "page.html", every=1, contacts=0)
    assert page_of(tesdf.view(simulated(UNRECORDED))._repr_html_()) == bare
    asked = page(simulated(UNRECORDED), tmp_path / "page.html", every=1)
    assert page_of(tesdf.view(simulated(UNRECORDED), every=1, contacts=128)._repr_html_()) == asked
    assert len(asked) > len(bare)


def test_a_large_page_in_a_notebook_says_what_to_call(simulated, notebook, monkeypatch):
    monkeypatch.setattr(tesdf.playback, "_NOTEBOOK_BYTES", 1000)
    shown = tesdf.view(simulated(SCENE))._repr_html_()
    assert '<code>tesdf.view(run, "page.html")</code>' in shown and len(shown) < 300


def test_progress(simulated, tmp_path):
    simulation = simulated(UNRECORDED)
    seen = []
    tesdf.view(simulation, tmp_path / "page.html", progress=lambda *state: seen.append(state))
    assert seen[-1] == ("contacts", 1.0) and all(0 <= share <= 1 for _, share in seen)
    stages = ["refine", "tighten", "assemble", "contacts"]
    assert sorted(seen, key=lambda state: stages.index(state[0])) == seen

    def stop(stage, share):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        tesdf.view(simulation, tmp_path / "none.html", progress=stop)
