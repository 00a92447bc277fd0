"""Contacts in MuJoCo by tesdf, by MuJoCo's own signed distance fields, by convex hulls, and by convex decompositions.

python lab/scripts/mujoco_peers.py [--scenes nut peg gears] [--by tesdf sdf hulls coacd] [--limit 300]

Each case runs in a process of its own. One that takes longer than the limit ends there, and the line says how far it
came. Penetration is by the exact clearance of tesdf, at eight times spread over the run. Needs mujoco and coacd.
"""

import argparse
import json
import multiprocessing
import resource
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np
import tesdf
import tesdf.mujoco
from tesdf._mujoco_model import weigh

PARTS = Path(__file__).resolve().parents[2] / "data" / "procedural"

# Bodies: name, mesh, pose, what it may do. The first one is watched, relative to the second.
SCENES = {
    "nut": {
        "gravity": "0 0 -9.81",
        "seconds": 0.1,
        "bodies": [
            ("nut", "iso_m16_nut_c50.obj", 'pos="0 0 0.036" quat="0 1 0 0"', "<freejoint/>"),
            ("bolt", "iso_m16_bolt_6k.obj", 'pos="0 0 0.04" quat="0 1 0 0"', ""),
        ],
        "actuator": "",
    },
    "peg": {
        "gravity": "0.74 0.42 -9.77",
        "seconds": 0.15,
        "bodies": [
            ("peg", "lobed_peg.obj", 'pos="0 0 0.015"', "<freejoint/>"),
            ("hole", "lobed_hole_c100.obj", "", ""),
        ],
        "actuator": "",
    },
    "gears": {
        "gravity": "0 0 0",
        "seconds": 0.2,
        "bodies": [
            ("driven", "spur_gear_m2_z20.obj", 'pos="0.04 0 0" euler="0 0 9"', '<joint name="driven" axis="0 0 1" damping="5e-4"/>'),
            ("driver", "spur_gear_m2_z20.obj", "", '<joint name="driver" axis="0 0 1"/>'),
        ],
        "actuator": '<motor joint="driver"/>',
    },
}


def model_of(scene, by, encoded, folder):
    """The text of the model."""
    assets, bodies = "", ""
    kind = "sdf" if by == "sdf" else "mesh"
    for (name, file, pose, joint), asset in zip(scene["bodies"], encoded):
        parts = decomposed(asset, folder / name) if by == "coacd" else [PARTS / file]
        geoms = ""
        for k, part in enumerate(parts):
            assets += f'<mesh name="{name}{k}" file="{part}"/>\n'
            geom = name if len(parts) == 1 else f"{name}{k}"
            geoms += f'<geom name="{geom}" type="{kind}" mesh="{name}{k}" density="7850" condim="1"/>\n'
        bodies += f'<body name="{name}" {pose}>{joint}{geoms}</body>\n'
    return f"""<mujoco>
  <option timestep="0.001" gravity="{scene["gravity"]}" integrator="implicitfast" cone="elliptic"/>
  <size memory="200M"/>
  <asset>{assets}</asset>
  <worldbody>{bodies}</worldbody>
  <actuator>{scene["actuator"]}</actuator>
</mujoco>"""


def decomposed(asset, folder):
    import coacd

    coacd.set_log_level("error")
    parts = coacd.run_coacd(coacd.Mesh(asset.vertices, asset.faces), seed=0)
    folder.mkdir()
    files = []
    for k, (corners, triangles) in enumerate(parts):
        files.append(folder / f"{k}.obj")
        lines = [f"v {x} {y} {z}\n" for x, y, z in corners] + [f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in triangles]
        files[-1].write_text("".join(lines))
    return files


def run(name, by, report):
    """Runs a case, and writes what is known so far into `report`."""
    scene = SCENES[name]
    found = {}

    def tell(**more):
        found.update(more, memory=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
        report.write_text(json.dumps(found))

    tell(at="building")
    folder = Path(tempfile.mkdtemp())
    start = time.perf_counter()
    assets = [tesdf.encode(PARTS / file, "fast") for _, file, _, _ in scene["bodies"]]
    encoding = time.perf_counter() - start
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    start = time.perf_counter()
    model = mujoco.MjModel.from_xml_string(model_of(scene, by, assets, folder))
    for geom in range(model.ngeom):
        # tesdf.mujoco.Contacts does so, too; here all get it.
        weigh(model, geom)
    tell(build=time.perf_counter() - start + (encoding if by == "tesdf" else 0), geoms=model.ngeom, before=before)
    data = mujoco.MjData(model)
    ours = None
    if by == "tesdf":
        ours = tesdf.mujoco.Contacts(model, {body[0]: asset for body, asset in zip(scene["bodies"], assets)})
    if model.nu:
        data.ctrl[0] = 2e-3  # N m
    exact = tesdf.Scene()
    for asset in assets:
        exact.add(exact.add_shape(asset))
    mujoco.mj_forward(model, data)
    first = state(model, data, scene)
    deepest, steps, spent, contacts = 0.0, round(scene["seconds"] / model.opt.timestep), 0.0, 0
    for step in range(steps):
        start = time.perf_counter()
        ours.step(model, data) if ours else mujoco.mj_step(model, data)
        spent += time.perf_counter() - start
        contacts = max(contacts, data.ncon)
        if (step + 1) % (steps // 8) == 0 or step == 0:
            exact.update(np.arange(2, dtype=np.uint32), poses=poses(model, data, scene))
            deepest = max(deepest, -exact.clearance(0, 1).distance)
        moved = (state(model, data, scene) - first).tolist()
        tell(at=f"step {step + 1} of {steps}", deepest=deepest * 1e6, steps_per_s=(step + 1) / spent, contacts=contacts, moved=moved)
    tell(at="end")


def state(model, data, scene):
    """Height of the first body, mm, and the angles of hinges, degrees."""
    z = data.body(scene["bodies"][0][0]).xpos[2] * 1e3
    return np.array([z, *np.degrees(data.qpos if model.nu else [])])


def poses(model, data, scene):
    """The poses of the files' frames, [2, 7]."""
    rows = []
    for name, *_ in scene["bodies"]:
        body = data.body(name)
        rows.append([*body.xpos, *np.roll(body.xquat, -1)])
    return np.array(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--by", nargs="+", choices=["tesdf", "sdf", "hulls", "coacd"], default=["tesdf", "sdf", "hulls", "coacd"])
    parser.add_argument("--limit", type=float, default=300, help="seconds of a case")
    options = parser.parse_args()
    print("| scene | contacts by | geoms | build, s | memory, MiB | moved, mm or ° | deepest, µm | contacts | steps per second | ended at |")
    print("|---|---|---:|---:|---:|---|---:|---:|---:|---|")
    for name in options.scenes:
        for by in options.by:
            report = Path(tempfile.mkdtemp()) / "report.json"
            process = multiprocessing.get_context("spawn").Process(target=run, args=(name, by, report))
            process.start()
            process.join(options.limit)
            if process.is_alive():
                process.kill()
                process.join()
            found = json.loads(report.read_text()) if report.exists() else {}

            def number(key, digits):
                return f"{found[key]:.{digits}f}" if key in found else ""

            grown = f"{found['memory'] - found['before']:.0f}" if "before" in found else ""
            moved = ", ".join(f"{x:.3f}" for x in found.get("moved", []))
            cells = [name, by, number("geoms", 0), number("build", 1), grown, moved, number("deepest", 1), number("contacts", 0), number("steps_per_s", 1)]
            print("| " + " | ".join(cells) + f" | {found.get('at', 'start')} |", flush=True)


if __name__ == "__main__":
    main()
