"""A nut turns down its bolt in MuJoCo, with contacts of tesdf.

python examples/python/mujoco_nut_on_bolt.py [--seconds 0.2]
"""

import argparse
from pathlib import Path

import mujoco
import numpy as np
import tesdf
import tesdf.mujoco

HERE = Path(__file__).resolve().parent
PARTS = HERE.parents[1] / "data" / "procedural"
PITCH = 2e-3  # m

arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
arguments.add_argument("--seconds", type=float, default=0.2)
seconds = arguments.parse_args().seconds

model = mujoco.MjModel.from_xml_path(str(HERE / "models" / "bolt-nut.xml"))
data = mujoco.MjData(model)
assets = {
    "bolt": tesdf.encode(PARTS / "iso_m16_bolt_24k.obj", "fast"),
    "nut": tesdf.encode(PARTS / "iso_m16_nut_c50.obj", "fast"),
}
contacts = tesdf.mujoco.Contacts(model, assets)

mujoco.mj_forward(model, data)
nut = model.body("nut").id
start, turns = data.xpos[nut, 2], 0.0
while data.time < seconds - 1e-9:
    contacts.step(model, data)
    turns += data.qvel[5] * model.opt.timestep / (2 * np.pi)

travel = start - data.xpos[nut, 2]
clearance = contacts.scene.clearance(0, 1).distance
print(f"{seconds} s: {travel * 1e3:.3f} mm down, {turns:.4f} turns, {len(contacts.last)} contacts")
print(f"travel and turns differ by {abs(travel - turns * PITCH) * 1e6:.1f} µm; the play of the thread is 58 µm")
print(f"exact clearance in the end: {clearance * 1e6:.2f} µm")
assert turns > 0 and abs(travel - turns * PITCH) < 58e-6 and clearance > -1e-6
