"""A frictionless nut turns down its bolt in a physics engine, with contacts of tesdf: the tables of
docs/integrations.md.

    python lab/scripts/engines.py mujoco-warp --time-step 0.001 0.002 0.005
    python lab/scripts/engines.py newton --solver XPBD --iterations 20
    python lab/scripts/engines.py mujoco --shares      # of the time of a step

It needs the wheel of tesdf, and mujoco, mujoco-warp or newton.
"""

import argparse
import cProfile
import pstats
import time
from pathlib import Path

import numpy as np
import tesdf

PARTS = Path(__file__).resolve().parents[2] / "data" / "procedural"
FILES = {"bolt": PARTS / "iso_m16_bolt_24k.obj", "nut": PARTS / "iso_m16_nut_c50.obj"}
MODEL = PARTS.parents[1] / "examples" / "python" / "models" / "bolt-nut.xml"
PITCH, START = 2e-3, 0.036  # m


def ideal(inertia, mass):
    """The acceleration of an ideal screw, in m/s²."""
    return 9.81 / (1 + inertia / mass * (2 * np.pi / PITCH) ** 2)


def mujoco_model(step):
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(MODEL))
    model.opt.timestep = step
    nut, axes = model.body("nut").id, np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.body_iquat[nut])
    inertia = axes.reshape(3, 3)[2] ** 2 @ model.body_inertia[nut]
    return model, ideal(inertia, model.body_mass[nut])


def in_mujoco(step, assets, given, options):
    import mujoco
    import tesdf.mujoco

    model, acceleration = mujoco_model(step)
    data = mujoco.MjData(model)
    contacts = tesdf.mujoco.Contacts(model, assets, **options)
    return contacts, acceleration, lambda: contacts.step(model, data), lambda: (data.qpos[2], data.qvel[5])


def in_mujoco_warp(step, assets, given, options):
    import mujoco_warp as mjw
    import tesdf.mujoco_warp

    model, acceleration = mujoco_model(step)
    contacts = tesdf.mujoco_warp.Contacts(model, assets, **options)
    m, d = mjw.put_model(model), mjw.make_data(model, nconmax=12_000, njmax=12_000)
    state = lambda: (d.qpos.numpy()[0, 2], d.qvel.numpy()[0, 5])  # noqa: E731
    return contacts, acceleration, lambda: contacts.step(m, d), state


def in_newton(step, assets, given, options):
    import newton
    import tesdf.newton
    import warp as wp

    builder = newton.ModelBuilder()
    newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
    friction = {} if given.torsional else {"mu_torsional": 0.0, "mu_rolling": 0.0}
    config = newton.ModelBuilder.ShapeConfig(density=7850, mu=0.0, gap=1e-4, **friction)
    attributes = {**({} if given.soft else tesdf.newton.rigid(step)), "mujoco:condim": 1}
    for name, height in (("bolt", 0.04), ("nut", START)):
        asset, frame = assets[name], wp.transform((0, 0, height), (1.0, 0.0, 0.0, 0.0))
        mesh = newton.Mesh(asset.vertices.astype(np.float32), asset.faces.astype(np.int32).ravel())
        body, frame = (-1, frame) if name == "bolt" else (builder.add_body(xform=frame), None)
        builder.add_shape_mesh(body, xform=frame, mesh=mesh, cfg=config, label=name, custom_attributes=attributes)
    model = builder.finalize(device="cpu")
    if given.solver == "MuJoCo":
        solver = newton.solvers.SolverMuJoCo(
            model,
            use_mujoco_contacts=False,
            use_speculative_contacts=not given.no_look_ahead,
            integrator="implicitfast",
            cone="elliptic",
            njmax=12_000,
            nconmax=12_000,
        )
    else:
        solver = newton.solvers.SolverXPBD(model, iterations=given.iterations)
    pipeline = newton.CollisionPipeline(model, rigid_contact_max=12_000, speculative_contact_gap_max=1e-3)
    narrow = pipeline.narrow_phase = tesdf.newton.NarrowPhase(pipeline, assets, **options)
    contacts, control, states = pipeline.contacts(), model.control(), [model.state(), model.state()]

    def advance():
        states[0].clear_forces()
        pipeline.collide(states[0], contacts, dt=step)
        solver.step(*states, control, contacts, step)
        states.reverse()

    acceleration = ideal(model.body_inertia.numpy()[0][2, 2], model.body_mass.numpy()[0])
    return narrow, acceleration, advance, lambda: (states[0].body_q.numpy()[0, 2], -states[0].body_qd.numpy()[0, 5])


def shares(advance, steps):
    """Prints who takes the processor time of a step: MuJoCo, detection and filling in Rust, or the rest of the
    coupling in Python."""
    profile = cProfile.Profile(time.process_time)
    profile.enable()
    for _ in range(steps):
        advance()
    profile.disable()
    found = {"MuJoCo": 0.0, "detection": 0.0, "filling": 0.0, "coupling": 0.0}
    of = {"mujoco._functions": "MuJoCo", "fill_mujoco_contacts": "filling", "tesdf.Scene": "detection", "tesdf._native": "detection"}
    for (_, _, function), (_, _, own, _, _) in pstats.Stats(profile).stats.items():
        found[next((who for part, who in of.items() if part in function), "coupling")] += own
    for name, seconds in found.items():
        print(f"{name}: {seconds / steps * 1e3:.2f} ms a step, {100 * seconds / sum(found.values()):.1f} %")


ENGINES = {"mujoco": in_mujoco, "mujoco-warp": in_mujoco_warp, "newton": in_newton}

arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
arguments.add_argument("engine", choices=ENGINES)
arguments.add_argument("--time-step", type=float, nargs="+", default=[1e-3, 2e-3, 5e-3])
arguments.add_argument("--seconds", type=float, default=0.2)
arguments.add_argument("--reduce", type=int, help="contacts of the pair that are kept")
arguments.add_argument("--solver", choices=["MuJoCo", "XPBD"], default="MuJoCo", help="Newton's solver")
arguments.add_argument("--iterations", type=int, default=2, help="those of XPBD")
arguments.add_argument("--torsional", action="store_true", help="with Newton's default torsional and rolling friction")
arguments.add_argument("--soft", action="store_true", help="with Newton's default stiffness")
arguments.add_argument("--no-look-ahead", action="store_true", help="without Newton's use_speculative_contacts")
arguments.add_argument("--shares", action="store_true", help="prints who takes the processor time of a step, and ends; for mujoco")
given = arguments.parse_args()
if given.shares and given.engine != "mujoco":
    arguments.error("--shares is for mujoco")

assets = {name: tesdf.encode(file, "fast") for name, file in FILES.items()}
options = {"reduce": given.reduce} if given.reduce else {}
if not given.shares:
    print("| time step, ms | acceleration / ideal | travel / ideal | deepest, µm | contacts | steps per second |")
for step in given.time_step:
    contacts, acceleration, advance, state = ENGINES[given.engine](step, assets, given, options)
    count, spins, deepest = round(given.seconds / step), [], 0.0
    advance()  # compiles the kernels
    if given.shares:
        shares(advance, count)
        continue
    began = time.perf_counter()
    for k in range(1, count):
        advance()
        spins.append(state()[1])
        if k % (count // 8) == 0:
            deepest = max(deepest, -contacts.scene.clearance(0, 1).distance)
    rate = (count - 1) / (time.perf_counter() - began)
    half = len(spins) // 2
    slope = np.polyfit(step * np.arange(half), spins[-half:], 1)[0] * PITCH / (2 * np.pi)
    travel = (START - state()[0]) / (acceleration * given.seconds**2 / 2)
    print(
        f"| {step * 1e3:g} | {slope / acceleration:.2f} | {travel:.2f} | {deepest * 1e6:.1f} | {len(contacts.last):,} "
        f"| {rate:.1f} |",
        flush=True,
    )
