"""SolverXPBD of Newton resists the spin of a body without friction: it applies ShapeConfig.mu_torsional, whose
default is 0.005 m, although mu is 0. A minimal example, without tesdf.

    pip install newton==1.8.0
    python lab/scripts/newton_torsional_friction.py

A ball without friction spins on the ground about the vertical axis. Nothing resists, so its spin should stay.
"""

import newton
import warp as wp

SPIN, STEP, STEPS = 1.0, 0.002, 100  # rad/s, s


def spin_after(**material):
    """The spin of the ball after 0.2 s, in rad/s."""
    builder = newton.ModelBuilder()
    config = newton.ModelBuilder.ShapeConfig(density=1000, mu=0.0, **material)
    builder.add_ground_plane(cfg=config)
    ball = builder.add_body(xform=wp.transform((0.0, 0.0, 0.1), wp.quat_identity()))
    builder.add_shape_sphere(ball, radius=0.1, cfg=config)
    model = builder.finalize(device="cpu")
    solver = newton.solvers.SolverXPBD(model, iterations=20)
    pipeline = newton.CollisionPipeline(model)
    contacts, control = pipeline.contacts(), model.control()
    before, after = model.state(), model.state()
    velocities = before.body_qd.numpy()
    velocities[ball] = [0, 0, 0, 0, 0, SPIN]
    before.body_qd.assign(velocities)
    for _ in range(STEPS):
        before.clear_forces()
        pipeline.collide(before, contacts)
        solver.step(before, after, control, contacts, STEP)
        before, after = after, before
    return float(before.body_qd.numpy()[ball, 5])


default, without = spin_after(), spin_after(mu_torsional=0.0)
print(f"mu = 0, mu_torsional at its default: {default:.4f} rad/s of {SPIN}")
print(f"mu = 0, mu_torsional = 0:            {without:.4f} rad/s of {SPIN}")
assert abs(without - SPIN) < 1e-3, "a ball without friction keeps its spin"
assert default > 0.9 * SPIN, "a ball with mu = 0 is slowed down by torsional friction"
