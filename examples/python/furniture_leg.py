"""A desk leg of furniture-bench is screwed into its top in MuJoCo, with contacts of tesdf.

python examples/python/furniture_leg.py
"""

from pathlib import Path

import mujoco
import numpy as np
import tesdf
import tesdf.mujoco

MESHES = Path(__file__).resolve().parents[2] / "data" / "public"
PITCH, PLAY = 9e-3, 3.2e-3  # m; of the printed thread, and how far the leg moves in it without turning
assets = {
    "top": tesdf.encode(MESHES / "furniture_bench_desk_top.obj", "fast"),
    "leg": tesdf.encode(MESHES / "furniture_bench_desk_leg1.obj", "fast"),
}

# The top lies upside down, with its y axis up. The thread of the leg is in its hole, 6 mm above the seat.
spec = mujoco.MjSpec()
spec.option.timestep = 5e-3
spec.memory = 200 << 20
for name, asset in assets.items():
    spec.add_mesh(name=name, uservert=asset.vertices.ravel(), userface=asset.faces.ravel())
mesh = {"type": mujoco.mjtGeom.mjGEOM_MESH, "friction": [0.1, 0, 0]}
spec.worldbody.add_geom(name="top", meshname="top", euler=[90, 0, 0], **mesh)
leg = spec.worldbody.add_body(name="leg", pos=[-0.08, 0.05, 0.0716], euler=[90, 100, 0])
leg.add_freejoint()
leg.add_geom(name="leg", meshname="leg", density=1000, **mesh)
model = spec.compile()
data = mujoco.MjData(model)
contacts = tesdf.mujoco.Contacts(model, assets)

mujoco.mj_forward(model, data)
body = model.body("leg").id
start, turns = data.xpos[body, 2], 0.0
while data.time < 0.3 - 1e-9:
    spin = (data.xmat[body].reshape(3, 3) @ data.qvel[3:6])[2]
    # A hand presses with 1 N and turns at up to 15 rad/s, with at most 0.03 N m.
    data.xfrc_applied[body] = [0, 0, -1, 0, 0, np.clip(2e-3 * (-15 - spin), -0.03, 0.03)]
    contacts.step(model, data)
    turns -= (data.xmat[body].reshape(3, 3) @ data.qvel[3:6])[2] * model.opt.timestep / (2 * np.pi)

travel, clearance = start - data.xpos[body, 2], contacts.scene.clearance(0, 1).distance
print(f"{data.time:.1f} s: {travel * 1e3:.2f} mm down, {turns:.3f} turns, {len(contacts.last)} contacts")
print(f"travel and turns differ by {abs(travel - turns * PITCH) * 1e3:.2f} mm; the thread has {PLAY * 1e3} mm of play")
print(f"exact clearance in the end: {clearance * 1e6:.1f} µm")
assert travel > 4e-3 and abs(travel - turns * PITCH) < PLAY and clearance > -1e-5
