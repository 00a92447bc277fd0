"""Nuts turn down their bolts in the worlds of MJWarp, each under its own gravity, with contacts of tesdf.

python examples/python/mujoco_warp_nuts_on_bolts.py [--worlds 2] [--seconds 0.1]
"""

import argparse
from pathlib import Path

import mujoco
import mujoco_warp as mjw
import numpy as np
import tesdf
import tesdf.mujoco_warp
import warp as wp

HERE = Path(__file__).resolve().parent
PARTS = HERE.parents[1] / "data" / "procedural"
PITCH = 2e-3  # m

arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
arguments.add_argument("--worlds", type=int, default=2)
arguments.add_argument("--seconds", type=float, default=0.1)
given = arguments.parse_args()

model = mujoco.MjModel.from_xml_path(str(HERE / "models" / "bolt-nut.xml"))
model.opt.timestep = 0.002
assets = {
    "bolt": tesdf.encode(PARTS / "iso_m16_bolt_24k.obj", "fast"),
    "nut": tesdf.encode(PARTS / "iso_m16_nut_c50.obj", "fast"),
}
contacts = tesdf.mujoco_warp.Contacts(model, assets, nworld=given.worlds)
m = mjw.put_model(model)
d = mjw.make_data(model, nworld=given.worlds, nconmax=12_000, njmax=12_000)
pulls = 9.81 * np.linspace(1, 2, given.worlds)
m.opt.gravity = wp.array([[0, 0, -pull] for pull in pulls], dtype=wp.vec3)

start, turns = d.qpos.numpy()[:, 2].copy(), np.zeros(given.worlds)
for _ in range(round(given.seconds / model.opt.timestep)):
    contacts.step(m, d)
    turns += d.qvel.numpy()[:, 5] * model.opt.timestep / (2 * np.pi)

travel = start - d.qpos.numpy()[:, 2]
scene = contacts.scene
print(f"after {given.seconds} s, {len(contacts.last)} contacts in {given.worlds} worlds")
for world, pull in enumerate(pulls):
    clearance = scene.clearance(2 * world, 2 * world + 1).distance
    print(
        f"gravity {pull:.2f}: {travel[world] * 1e3:.3f} mm down, {turns[world]:.4f} turns, "
        f"exact clearance {clearance * 1e6:.2f} µm"
    )
    assert turns[world] > 0 and clearance > -1e-6
    # The play of the thread is 58 µm.
    assert abs(travel[world] - turns[world] * PITCH) < 58e-6
