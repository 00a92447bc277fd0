"""Pages and animations of runs, in headless Chromium."""

import io
import json
import os
import subprocess
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import tesdf
from PIL import Image
from playwright.sync_api import sync_playwright

SCENE = """
time_step = 2e-3
duration = 0.2

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "cube"
mesh = "cube.obj"
density = 1000
translation = [1000, 0, 0.03]
rotation = [0.2, 0.1, 0, 0.9746794344808963]
velocity = [0.1, 0, 0]

[[bodies]]
name = "ball"
shape = { sphere = { radius = 0.01 } }
density = 1000
translation = [1000.05, 0.02, 0.05]
angular_velocity = [0, 0, 9]

[[bodies]]
name = "post"
shape = { capsule = { half_height = 0.02, radius = 0.005 } }
fixed = true
translation = [999.95, 0, 0.025]

[detector]
contact_distance = 1e-3

[record]
forces_every = 10
"""
# WebGL without a graphics card, and nothing that Chromium itself asks the network for.
FLAGS = """--no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader --disable-quic --no-first-run
    --disable-background-networking --disable-component-update --disable-sync --force-color-profile=srgb""".split()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """a folder with a run, its page and its animation"""
    folder = tmp_path_factory.mktemp("playback")
    cube = Path(__file__).resolve().parents[3] / "data" / "procedural" / "cube.obj"
    (folder / "cube.obj").write_bytes(cube.read_bytes())
    (folder / "scene.toml").write_text(SCENE)
    simulation = tesdf.Simulation(folder / "scene.toml")
    simulation.run()
    simulation.save(folder / "run.tesrun")
    tesdf.view(folder / "run.tesrun", folder / "page.html")
    tesdf.export(folder / "run.tesrun", folder / "run.glb")
    tesdf.view(simulation, folder / "simulation.html", title="run")
    tesdf.export(simulation, folder / "simulation.glb")
    np.savez(folder / "record.npz", times=simulation.record().times, poses=simulation.record().poses)
    return folder


@pytest.fixture(scope="module")
def record(folder):
    return np.load(folder / "record.npz")


@pytest.fixture(scope="module")
def browser():
    program = os.environ.get("TESDF_CHROMIUM")
    assert program, "TESDF_CHROMIUM must name Chromium, as .ci/chromium.sh does"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture
def tab(browser):
    """a page of the browser that must not have errors or messages; tab.asked has its requests"""
    tab = browser.new_page(viewport={"width": 760, "height": 480})
    tab.asked, said = [], []
    tab.on("request", lambda request: tab.asked.append(request.url))
    # The driver may say that reading the pixel under the mouse waits for the picture, which it must.
    stalls = "GPU stall due to ReadPixels"
    tab.on("console", lambda message: said.append(message.text) if stalls not in message.text else None)
    tab.on("pageerror", lambda error: said.append(str(error)))
    yield tab
    tab.close()
    assert said == []


@pytest.fixture
def page(tab, folder):
    """the page of the run, when it has drawn its first picture"""
    address = (folder / "page.html").as_uri()
    tab.goto(address)
    tab.wait_for_selector("body.ready")
    yield tab
    assert tab.asked == [address], "the page asks for nothing but itself"


CLIP = {"x": 250, "y": 45, "width": 500, "height": 360}


def wait(page, condition):
    """waits for a condition of the page, whose policy forbids what wait_for_function does"""
    for _ in range(400):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(50)
    raise AssertionError(f"not in 20 s: {condition}")


def picture(page):
    """the picture without the controls, RGB"""
    page.mouse.move(755, 200)
    # The picture of a change is there after two frames.
    page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    png = page.screenshot(clip=CLIP)
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def changed(a, b):
    """number of pixels that differ clearly"""
    return (np.abs(a - b).max(2) > 24).sum()


def test_the_command_gives_the_same_bytes(folder):
    program = os.environ.get("TESDF_CLI")
    assert program, "TESDF_CLI must name the program tesdf, as .ci/python.sh builds it"
    for command, name, other in [("view", "page.html", "simulation.html"), ("export", "run.glb", "simulation.glb")]:
        out = folder / f"command-{name}"
        subprocess.run([program, command, folder / "run.tesrun", "-o", out], stdout=subprocess.PIPE, check=True)
        assert out.read_bytes() == (folder / name).read_bytes() == (folder / other).read_bytes()


def test_play_and_slider_move_the_bodies(page):
    first = picture(page)
    assert changed(first, picture(page)) == 0
    # The picture has a background, a floor and bodies in their colours.
    colours = first.reshape(-1, 3)
    assert len(np.unique(colours // 32, axis=0)) > 10 and (colours.min(1) > 200).mean() > 0.3
    blue, amber = (colours[:, 2] > colours[:, 0] + 40).sum(), (colours[:, 0] > colours[:, 2] + 60).sum()
    assert blue > 500 and amber > 200

    box = page.locator("#slider").bounding_box()
    page.mouse.click(box["x"] + 0.6 * box["width"], box["y"] + box["height"] / 2)
    later = picture(page)
    assert page.inner_text("#facts").startswith("frame 6") and changed(first, later) > 500

    page.keyboard.press("Home")
    assert changed(first, picture(page)) == 0 and page.inner_text("#facts") == "frame 1 of 101 · step 0"
    page.click("#play")
    wait(page, "parseFloat(document.getElementById('slider').value) > 20")
    page.click("#play")
    playing = picture(page)
    stopped = page.inner_text("#time")
    assert changed(playing, picture(page)) == 0 and page.inner_text("#time") == stopped
    assert changed(first, playing) > 500
    # A loop begins again; without it the run stops at its end.
    page.click("#loop")
    page.select_option("#speed", label="10 ×")
    page.keyboard.press("End")
    page.keyboard.press("Space")
    wait(page, "document.getElementById('facts').textContent.startsWith('frame 101 ') && !document.body.classList.contains('playing')")


def test_keys_step_through_the_run(page):
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowLeft")
    picture(page)
    assert page.inner_text("#facts").startswith("frame 2 ")
    page.keyboard.press("Shift+ArrowRight")
    picture(page)
    assert page.inner_text("#facts").startswith("frame 12 ")
    speed = page.eval_on_selector("#speed", "select => select.selectedIndex")
    page.keyboard.press("ArrowUp")
    assert page.eval_on_selector("#speed", "select => select.selectedIndex") == speed + 1
    # A focused button does not act twice on one key.
    page.focus("#play")
    page.keyboard.press("Space")
    wait(page, "document.body.classList.contains('playing')")
    page.keyboard.press("Space")
    wait(page, "!document.body.classList.contains('playing')")


def test_forces_are_arrows_on_a_body_that_can_be_hidden(page):
    page.keyboard.press("End")
    assert "in step 90" in page.inner_text("#force-facts")
    assert not page.is_checked("#show-contacts")
    drawn = picture(page)
    page.keyboard.press("p")
    assert not page.is_checked("#show-forces")
    assert changed(drawn, picture(page)) > 30


def test_contacts_are_arrows_that_can_be_hidden(page):
    page.keyboard.press("End")
    without = picture(page)
    assert " contact" in page.inner_text("#contact-facts")
    page.click("#show-contacts")
    assert changed(picture(page), without) > 50
    page.keyboard.press("c")
    assert changed(picture(page), without) == 0


def test_bodies_have_names_and_can_be_hidden(page):
    assert page.locator("#bodies li").all_inner_texts() == ["floor", "cube", "ball", "post"]
    before = picture(page)
    for name in ("cube", "ball", "post"):
        page.click(f"text={name}")
        difference = np.abs(before - picture(page)).sum(2)
        assert (difference > 24).sum() > 100
        page.click(f"text={name}")
        # The body has its name where it was: in the middle of the 5 x 5 pixels that changed most.
        sums = np.lib.stride_tricks.sliding_window_view(difference, (5, 5)).sum((2, 3))
        y, x = np.unravel_index(sums.argmax(), sums.shape)
        page.mouse.move(float(CLIP["x"] + x + 2), float(CLIP["y"] + y + 2))
        wait(page, "!document.getElementById('name').hidden")
        assert page.inner_text("#name") == name
    assert changed(before, picture(page)) == 0


def test_the_mouse_moves_the_camera(page):
    before = picture(page)
    page.mouse.move(450, 200)
    page.mouse.down()
    page.mouse.move(550, 180, steps=2)
    page.mouse.up()
    turned = picture(page)
    assert changed(before, turned) > 1000
    page.mouse.move(450, 200)
    page.mouse.down(button="right")
    page.mouse.move(510, 200, steps=2)
    page.mouse.up(button="right")
    moved = picture(page)
    # The picture moved with the mouse.
    assert changed(turned, moved) > 1000 and changed(turned[:, :-60], moved[:, 60:]) < changed(turned, moved) / 4
    page.mouse.move(450, 200)
    page.mouse.wheel(0, -300)
    assert changed(moved, picture(page)) > 1000


def test_the_page_has_the_poses_of_the_run(page, record):
    run = page.evaluate(
        """readRun().then((run) => ({ times: run.times, bodies: run.bodies.map(({ name }) => name),
             poses: run.bodies.map((body) => run.times.map((_, frame) => poseAt(body, run.times.length, frame, 0))) }))"""
    )
    assert run["times"] == record["times"].tolist() and run["bodies"] == ["floor", "cube", "ball", "post"]
    expected = record["poses"]
    for body in (1, 2, 3):
        found = np.array([pose["position"] for pose in run["poses"][body]])
        # Positions are relative to the middle of the run.
        motion, of_run = (p - p[0] for p in (found, expected[:, body, :3]))
        assert np.abs(motion - of_run).max() < 2e-8, "1 km from the origin, 20 nm"
        turns = np.array([pose["turn"] for pose in run["poses"][body]])
        assert np.abs(np.abs((turns * expected[:, body, 3:]).sum(1)) - 1).max() < 1e-6


def test_three_js_plays_the_animation(tab, folder, record):
    three = os.environ.get("TESDF_THREE")
    assert three, "TESDF_THREE must name the folder of three.js, as .ci/chromium.sh does"
    page = """<!doctype html><link rel="icon" href="data:,"><script type="importmap">
        {"imports": {"three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/"}}</script>
        <script type="module">
        import * as three from "three";
        import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
        const file = await new GLTFLoader().loadAsync("/run.glb");
        const mixer = new three.AnimationMixer(file.scene);
        file.animations.forEach((clip) => mixer.clipAction(clip).play());
        window.names = () => { const names = []; file.scene.getObjectByName("run").children.forEach((node) => names.push(node.name)); return names; };
        window.at = (time, name) => {
          mixer.setTime(time);
          file.scene.updateMatrixWorld(true);
          return file.scene.getObjectByName(name).matrixWorld.elements;
        };
        window.ready = true;
        </script>"""
    origin = "http://playback.test"

    def answer(route):
        path = route.request.url.removeprefix(origin)
        if path == "/":
            return route.fulfill(body=page, content_type="text/html")
        file = folder / "run.glb" if path == "/run.glb" else Path(three, *path.split("/")[2:])
        kind = "text/javascript" if path.endswith(".js") else "model/gltf-binary"
        return route.fulfill(body=file.read_bytes(), content_type=kind)

    tab.route("**/*", answer)
    tab.goto(origin + "/")
    tab.wait_for_function("window.ready")
    assert tab.evaluate("names()") == ["floor", "cube", "ball", "post"]
    upright = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    times, poses = record["times"], record["poses"]
    for step in (0, 7, 50, 99):
        for body, name in enumerate(["floor", "cube", "ball", "post"][1:], 1):
            matrix = np.array(tab.evaluate("([time, name]) => at(time, name)", [times[step], name])).reshape(4, 4).T
            x, y, z, w = poses[step, body, 3:]
            rotation = np.array(
                [
                    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
                ]
            )
            assert np.abs(upright @ matrix[:3, :3] - rotation).max() < 1e-4
            assert np.abs(upright @ matrix[:3, 3] - poses[step, body, :3]).max() < 2e-8, "1 km from the origin, 20 nm"


def test_options_and_errors(folder, tmp_path):
    run, out = folder / "run.tesrun", tmp_path / "out"
    view, export = partial(tesdf.view, run, out), partial(tesdf.export, run, out)

    def described():
        return json.loads(out.read_text().split('id="run">')[1].split("</script>")[0])

    view(every=30, contacts=0, title="<b>")
    assert described()["steps"] == [0, 30, 60, 90, 100] and described()["contacts"] is None and "<h1>&lt;b></h1>" in out.read_text()
    view(fps=50.0)
    assert described()["steps"] == list(range(0, 101, 10))
    view(geometries={"cube": folder / "cube.obj"})
    with pytest.raises(ValueError, match="fps is given"):
        view(every=2, fps=3.0)
    with pytest.raises(tesdf.SimulationError, match="fps is -1; expected a positive number"):
        export(fps=-1)
    with pytest.raises(tesdf.SimulationError, match="speed is 0"):
        export(speed=0)
    with pytest.raises(tesdf.SceneError, match="there is no body cup"):
        view(geometries={"cup": "cup.obj"})
    with pytest.raises(tesdf.SceneError, match="none.obj"):
        view(geometries={"cube": "none.obj"})
    with pytest.raises(FileNotFoundError, match="none.tesrun"):
        tesdf.view(tmp_path / "none.tesrun", out)
    with pytest.raises(FileNotFoundError):
        tesdf.view(run, tmp_path / "nowhere" / "page.html")
    with pytest.raises(OSError, match="is the input"):
        tesdf.view(run, run)
    with pytest.raises(tesdf.SimulationError, match="not a run of tesdf"):
        tesdf.export(folder / "cube.obj", out)
    with pytest.raises(ValueError, match="run: int; expected a path, a Simulation, or a Record"):
        tesdf.view(3, out)
    with pytest.raises(ValueError, match="geometries: given for a Simulation"):
        tesdf.view(tesdf.Simulation(folder / "scene.toml"), out, geometries={})


def test_a_live_page_follows_the_steps_and_stays_when_they_end(tab, folder):
    simulation = tesdf.Simulation(folder / "scene.toml")
    view = simulation.view(title="live")
    tab.goto(view.url)
    tab.wait_for_selector("body.ready")
    first = picture(tab)
    for _ in range(100):
        simulation.step()
        tab.wait_for_timeout(5)
    wait(tab, "element('facts').textContent.includes('step 9')")
    assert "being made" in tab.inner_text("#live")
    assert " force" in tab.inner_text("#force-facts") and "N" in tab.inner_text("#force-facts")
    assert changed(first, picture(tab)) > 100
    del simulation
    wait(tab, "document.getElementById('live').textContent.includes('ended')")
    # What was sent remains, and plays.
    tab.keyboard.press("Home")
    assert "step 0" in tab.inner_text("#facts")
    assert {address.removeprefix(view.url) for address in tab.asked} <= {"", "frames"}
