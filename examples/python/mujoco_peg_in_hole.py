"""A peg slides into its hole in MuJoCo and seats, with contacts of tesdf.

python examples/python/mujoco_peg_in_hole.py
"""

from pathlib import Path

import mujoco
import tesdf
import tesdf.mujoco

HERE = Path(__file__).resolve().parent
PARTS = HERE.parents[1] / "data" / "procedural"

model = mujoco.MjModel.from_xml_path(str(HERE / "models" / "peg-in-hole.xml"))
data = mujoco.MjData(model)
assets = {
    "hole": tesdf.encode(PARTS / "lobed_hole_c100.obj", "fast"),
    "peg": tesdf.encode(PARTS / "lobed_peg.obj", "fast"),
}
contacts = tesdf.mujoco.Contacts(model, assets)

mujoco.mj_forward(model, data)
peg = model.body("peg").id
start, seated, deepest = data.xpos[peg, 2], None, 0.0
while data.time < 0.15:
    contacts.step(model, data)
    if seated is None and start - data.xpos[peg, 2] > 9.98e-3:
        seated = data.time
    if round(data.time / model.opt.timestep) % 25 == 0:
        deepest = max(deepest, -contacts.scene.clearance(0, 1).distance)

travel = start - data.xpos[peg, 2]
print(f"seated after {seated:.3f} s, {travel * 1e3:.3f} mm down")
print(f"deepest penetration by the exact clearance: {deepest * 1e6:.2f} µm")
assert seated is not None and abs(travel - 10e-3) < 2e-5 and deepest < 1e-5
