"""A nut turns down its bolt in Newton, with contacts of tesdf.

python examples/python/newton_nut_on_bolt.py [--seconds 0.05] [--time-step 0.002]
"""

import argparse
from pathlib import Path

import newton
import numpy as np
import tesdf
import tesdf.newton
import warp as wp

PARTS = Path(__file__).resolve().parents[2] / "data" / "procedural"
PITCH = 2e-3  # m

arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
arguments.add_argument("--seconds", type=float, default=0.05)
arguments.add_argument("--time-step", type=float, default=0.002)
given = arguments.parse_args()
step = given.time_step

assets = {
    "bolt": tesdf.encode(PARTS / "iso_m16_bolt_24k.obj", "fast"),
    "nut": tesdf.encode(PARTS / "iso_m16_nut_c50.obj", "fast"),
}
meshes = {
    name: newton.Mesh(asset.vertices.astype(np.float32), asset.faces.astype(np.int32).ravel())
    for name, asset in assets.items()
}

builder = newton.ModelBuilder()
newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
config = newton.ModelBuilder.ShapeConfig(density=7850, mu=0.0, gap=1e-4)
shape = {"cfg": config, "custom_attributes": {**tesdf.newton.rigid(step), "mujoco:condim": 1}}
# The bolt stands on its head, and the nut is threaded on by 4 mm.
flipped = (1.0, 0.0, 0.0, 0.0)
builder.add_shape_mesh(-1, xform=wp.transform((0, 0, 0.04), flipped), mesh=meshes["bolt"], label="bolt", **shape)
nut = builder.add_body(xform=wp.transform((0, 0, 0.036), flipped))
builder.add_shape_mesh(nut, mesh=meshes["nut"], label="nut", **shape)
model = builder.finalize(device="cpu")

solver = newton.solvers.SolverMuJoCo(
    model,
    use_mujoco_contacts=False,
    use_speculative_contacts=True,  # contacts that do not touch yet are limits of the velocity
    integrator="implicitfast",
    cone="elliptic",
    njmax=12_000,
    nconmax=12_000,
)
pipeline = newton.CollisionPipeline(model, rigid_contact_max=12_000, speculative_contact_gap_max=1e-3)
pipeline.narrow_phase = tesdf.newton.NarrowPhase(pipeline, assets)
contacts, control = pipeline.contacts(), model.control()

before, after, turns = model.state(), model.state(), 0.0
start = before.body_q.numpy()[nut, 2]
for _ in range(round(given.seconds / step)):
    before.clear_forces()
    pipeline.collide(before, contacts, dt=step)
    solver.step(before, after, control, contacts, step)
    before, after = after, before
    turns -= before.body_qd.numpy()[nut, 5] * step / (2 * np.pi)

travel = start - before.body_q.numpy()[nut, 2]
clearance = pipeline.narrow_phase.scene.clearance(0, 1).distance
print(f"{given.seconds} s: {travel * 1e3:.3f} mm down, {turns:.4f} turns, {len(pipeline.narrow_phase.last)} contacts")
print(f"exact clearance in the end: {clearance * 1e6:.2f} µm")
# The play of the thread is 58 µm.
assert turns > 0 and abs(travel - turns * PITCH) < 58e-6 and clearance > -1e-6
