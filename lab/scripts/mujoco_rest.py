"""Bodies at rest and chains under load: tesdf beside MuJoCo, time and error.

python lab/scripts/mujoco_rest.py path/to/tesdf [--seconds 2]

`stack` and `wall` are the scenes of the same names, with boxes in place of meshes in MuJoCo; nothing sleeps. `swing` is a
chain of 20 hinges with a heavy end that swings down from the horizontal. MuJoCo has its angles as coordinates, so its joints
cannot come apart; tesdf has links that joints hold. Steps of 5 ms, one thread, no friction. Needs mujoco and tomli_w.
"""

import argparse
import json
import os
import subprocess
import tempfile
import time
import tomllib
from pathlib import Path

import mujoco
import numpy as np
import tomli_w

ROOT = Path(__file__).resolve().parents[2]
STEP = 5e-3
LINKS, LINK, MASS = 20, 0.05, 0.05


def half_extents(body):
    """Of the box that a mesh is, m."""
    lines = (ROOT / "scenes" / body["mesh"]).read_text().splitlines()
    points = np.array([[float(x) for x in line.split()[1:4]] for line in lines if line.startswith("v ")])
    return body.get("scale", 1) * np.ptp(points, axis=0) / 2


def rest(name):
    """The scene of tesdf, and the model of MuJoCo."""
    scene = tomllib.loads((ROOT / "scenes" / name).read_text())
    for body in scene["bodies"]:
        if "mesh" in body:
            body["mesh"] = str((ROOT / "scenes" / body["mesh"]).resolve())
    geoms = [
        f'<body pos="{" ".join(map(str, body["translation"]))}"><freejoint/>'
        f'<geom type="box" density="{body["density"]}" size="{" ".join(map(str, half_extents(body)))}"/></body>'
        for body in scene["bodies"]
        if "mesh" in body
    ]
    return scene, f'<geom type="plane" size="9 9 1"/>{"".join(geoms)}'


def swing(load):
    """The same for a chain whose end weighs `load` kg."""
    half, bodies, joints = 0.1 * LINK / 2, [], []
    for k in range(LINKS):
        shape = {"box": {"half_extents": [LINK / 2, half, half]}}
        bodies.append({"name": f"l{k}", "shape": shape, "mass": MASS, "translation": [(k + 0.5) * LINK, 0, 0]})
        joint = {"name": f"j{k}", "kind": "hinge", "child": f"l{k}", "anchor": [k * LINK, 0, 0], "axis": [0, 1, 0]}
        joints.append(joint | ({"parent": f"l{k - 1}"} if k else {}))
    end = [(LINKS + 0.5) * LINK, 0, 0]
    bodies.append({"name": "load", "shape": {"sphere": {"radius": LINK / 2}}, "mass": load, "translation": end})
    joints.append({"name": "end", "kind": "weld", "parent": f"l{LINKS - 1}", "child": "load", "anchor": [LINKS * LINK, 0, 0]})
    xml = f'<body pos="{LINK} 0 0"><geom type="sphere" mass="{load}" size="{LINK / 2}" pos="{LINK / 2} 0 0"/></body>'
    for k in reversed(range(LINKS)):
        geom = f'<geom type="box" mass="{MASS}" size="{LINK / 2} {half} {half}" pos="{LINK / 2} 0 0"/>'
        xml = f'<body pos="{LINK if k else 0} 0 0"><joint axis="0 1 0"/>{geom}{xml}</body>'
    return {"gravity": [0, 0, -9.81], "detector": {"mode": "off"}, "bodies": bodies, "joints": joints}, xml


def by_tesdf(tesdf, scene, seconds):
    """Time a step, ms, and the summary."""
    scene |= {"time_step": STEP, "duration": seconds, "solver": {"sleep": 0.0}}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(tomli_w.dumps(scene))
        command = [tesdf, "simulate", str(path), "-o", str(Path(folder) / "run.tesrun"), "--json"]
        done = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"RAYON_NUM_THREADS": "1"})
    summary = json.loads(done.stdout)
    return summary["detection_ms"] + summary["solution_ms"], summary


def by_mujoco(xml, seconds, flags):
    """Time a step, ms, the greatest way of a body and depth of a contact, m, and the greatest gain of energy, J."""
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{STEP}"/><default><geom condim="1"/></default>'
        f'<option><flag energy="enable" {flags}/></option><worldbody>{xml}</worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    start, energy, depth, gain, spent = data.xpos.copy(), data.energy.sum(), 0.0, 0.0, 0.0
    for _ in range(round(seconds / STEP)):
        begin = time.perf_counter()
        mujoco.mj_step(model, data)
        spent += time.perf_counter() - begin
        depth = max(depth, -min((contact.dist for contact in data.contact[: data.ncon]), default=0.0))
        gain = max(gain, data.energy.sum() - energy)
    return 1e3 * spent / round(seconds / STEP), float(np.linalg.norm(data.xpos - start, axis=1).max()), depth, float(gain)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tesdf")
    parser.add_argument("--seconds", type=float, default=2.0)
    args = parser.parse_args()
    print("| case | by | ms a step | a body moves, m | depth or gap of a joint, m | energy gained |\n|---|---|---:|---:|---:|---:|")
    for name in ("stack", "wall"):
        scene, xml = rest({"stack": "stack.toml", "wall": "brick-wall.toml"}[name])
        took, summary = by_tesdf(args.tesdf, scene, args.seconds)
        print(f"| {name} | tesdf | {took:.2f} | {summary['rest']['drift']:.1e} | {summary['deepest_penetration']:.1e} | |")
        took, way, depth, _ = by_mujoco(xml, args.seconds, "")
        print(f"| | MuJoCo | {took:.2f} | {way:.1e} | {depth:.1e} | |")
    for load in (1.0, 20.0, 1000.0):
        scene, xml = swing(load)
        fall = 9.81 * LINK * (load * (LINKS + 0.5) + MASS * LINKS * LINKS / 2)
        took, summary = by_tesdf(args.tesdf, scene, args.seconds)
        gain = (summary["kinetic_energy"] - summary["released_energy"]) / fall
        print(f"| swing, {load:g} kg | tesdf | {took:.2f} | | {summary['joint_drift']['distance']:.1e} | {gain:.1%} at the end |")
        took, _, _, gain = by_mujoco(xml, args.seconds, 'contact="disable"')
        print(f"| | MuJoCo | {took:.2f} | | | at most {gain / fall:.1%} |")


if __name__ == "__main__":
    main()
