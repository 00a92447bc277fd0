"""Contacts in Newton: what its pipeline gets, and what bodies do in SolverMuJoCo. Run by .ci/python.sh in an
environment of its own, as newton needs an older mujoco."""

import newton
import numpy as np
import pytest
import tesdf
import tesdf.newton
import warp as wp
from conftest import python_blocks
from unoptimised_kernels import unoptimised

unoptimised()

STEP = 0.002
FLIPPED = (1.0, 0.0, 0.0, 0.0)


def mesh(asset):
    return newton.Mesh(asset.vertices.astype(np.float32), asset.faces.astype(np.int32).ravel(), compute_inertia=True)


def model_of(assets, worlds, with_ball=False):
    """The bolt stands on its head, and the nut is threaded on by 4 mm."""
    one = newton.ModelBuilder()
    newton.solvers.SolverMuJoCo.register_custom_attributes(one)
    cfg = newton.ModelBuilder.ShapeConfig(density=7850, mu=0.0, gap=1e-4)
    attributes = {**tesdf.newton.rigid(STEP), "mujoco:condim": 1}
    frame = wp.transform((0, 0, 0.04), FLIPPED)
    one.add_shape_mesh(-1, xform=frame, mesh=mesh(assets["bolt"]), cfg=cfg, label="bolt", custom_attributes=attributes)
    nut = one.add_body(xform=wp.transform((0, 0, 0.036), FLIPPED))
    one.add_shape_mesh(nut, mesh=mesh(assets["nut"]), cfg=cfg, label="nut", custom_attributes=attributes)
    if with_ball:
        ball = one.add_body(xform=wp.transform((0.1, 0, 0.0199), (0, 0, 0, 1.0)))
        one.add_shape_sphere(ball, radius=0.02, cfg=cfg, label="ball")
        one.add_ground_plane(cfg=cfg)
    builder = newton.ModelBuilder()
    newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
    builder.replicate(one, worlds)
    return builder.finalize(device="cpu")


def pipeline_of(model, room=12_000):
    return newton.CollisionPipeline(model, rigid_contact_max=room, speculative_contact_gap_max=1e-3)


def rotation(q):
    return np.array(wp.quat_to_matrix(wp.quat(*map(float, q)))).reshape(3, 3)


def test_the_pipeline_gets_the_contacts_of_the_scene(screw, monkeypatch):
    others = []

    def of_newton(self, **arguments):
        """Takes the place of Newton's narrow phase, whose kernels for meshes take long to compile."""
        count = int(arguments["candidate_pair_count"].numpy()[0])
        others.append(np.sort(arguments["candidate_pair"].numpy()[:count], axis=1))
        arguments["writer_data"].contact_count.fill_(count)

    monkeypatch.setattr(newton.geometry.NarrowPhase, "launch_custom_write", of_newton)
    model = model_of(screw, 2, with_ball=True)
    pipeline = pipeline_of(model)
    pipeline.narrow_phase = tesdf.newton.NarrowPhase(pipeline, screw)
    contacts, state = pipeline.contacts(), model.state()
    velocities = state.body_qd.numpy()
    velocities[0] = [0, 0.01, -0.02, 0, 0, 3]
    state.body_qd.assign(velocities)
    pipeline.collide(state, contacts, dt=STEP)

    found = pipeline.narrow_phase.last
    count = int(contacts.rigid_contact_count.numpy()[0])
    shapes = np.stack([contacts.rigid_contact_shape0.numpy(), contacts.rigid_contact_shape1.numpy()], 1)[:count]
    labels = np.array(model.shape_label)[shapes]
    # Newton gets the ball on the ground in each world. Its contacts come first.
    assert others[0].tolist() == [[2, 3], [6, 7]] and count == len(found) + 2 and len(found) > 4000
    threads = np.arange(count) >= 2
    assert (model.shape_world.numpy()[shapes[threads]] == (found.instance_a[:, None] // 2)).all()
    assert (shapes[threads] == pipeline.narrow_phase.shapes[np.stack([found.instance_b, found.instance_a], 1)]).all()
    assert (labels[threads][:, 0] != labels[threads][:, 1]).all()

    for side, points in ((0, found.point_b), (1, found.point_a)):
        local = getattr(contacts, f"rigid_contact_point{side}").numpy()[:count][threads]
        for shape in np.unique(shapes[threads]):
            body = model.shape_body.numpy()[shape]
            frame = state.body_q.numpy()[body] if body >= 0 else [0, 0, 0, 0, 0, 0, 1]
            rows = shapes[threads][:, side] == shape
            world = local[rows] @ rotation(frame[3:]).T + frame[:3]
            assert np.allclose(world, points[rows], atol=2e-8), (side, shape)
        assert (getattr(contacts, f"rigid_contact_margin{side}").numpy()[:count][threads] == 0).all()
        assert (getattr(contacts, f"rigid_contact_offset{side}").numpy()[:count][threads] == 0).all()
    assert np.allclose(contacts.rigid_contact_normal.numpy()[:count][threads], found.normal, atol=1e-6)
    # Newton has the velocity of the centre of mass, the scene that of the shape's origin.
    arm = rotation(state.body_q.numpy()[0, 3:]) @ -model.body_com.numpy()[0]
    linear = velocities[0, :3] + np.cross(velocities[0, 3:], arm)
    velocity = pipeline.narrow_phase.scene.instances.velocities[1]
    assert np.allclose(velocity, [*linear, *velocities[0, 3:]], atol=1e-6)


def test_the_nuts_turn_down_their_bolts(screw):
    """Runs the code of docs/integrations.md."""
    [code] = python_blocks("docs/integrations.md", "Newton")
    once, step = code.split("\n\npipeline.collide", 1)
    model = model_of(screw, 2)
    before, after = model.state(), model.state()
    names = {"model": model, "control": model.control(), "h": STEP, **screw}
    exec(once, names)
    inertia, mass = model.body_inertia.numpy()[0][2, 2], model.body_mass.numpy()[0]
    # Travel of an ideal screw of 2 mm pitch.
    ideal = 9.81 / (1 + inertia / mass * (2 * np.pi / 2e-3) ** 2) * 0.2**2 / 2
    turned = np.zeros(2)
    for _ in range(100):
        before.clear_forces()
        exec("pipeline.collide" + step, {**names, "state": before, "next_state": after})
        before, after = after, before
        turned -= before.body_qd.numpy()[:, 5] * STEP / (2 * np.pi)
    travel = 0.036 - before.body_q.numpy()[:, 2]
    assert (0.9 < travel / ideal).all() and (travel / ideal < 1.4).all()
    # Up to the play of the thread.
    assert (turned > 0.08).all() and (np.abs(travel - turned * 2e-3) < 1.2e-4).all(), (travel, turned)
    assert names["pipeline"].narrow_phase.scene.clearance(2, 3).distance > -1e-6


def test_what_does_not_fit_is_an_error(screw):
    model = model_of(screw, 1)
    pipeline = pipeline_of(model, room=100)
    narrow = tesdf.newton.NarrowPhase
    pipeline.narrow_phase = narrow(pipeline, screw)
    contacts = pipeline.contacts()
    with pytest.raises(ValueError, match=r"contacts, but the pipeline has room for 100; .*rigid_contact_max="):
        pipeline.collide(model.state(), contacts, dt=STEP)
    with pytest.raises(ValueError, match=r"there is no shape 'screw'; the labels are \['bolt'"):
        narrow(pipeline, {"screw": screw["nut"]})
    with pytest.raises(ValueError, match="shape 'nut': its mesh spans"):
        narrow(pipeline, {"nut": screw["bolt"]})
    with pytest.raises(ValueError, match="assets is empty"):
        narrow(pipeline, {})
    others = model_of(screw, 1, with_ball=True)
    with pytest.raises(ValueError, match="shape 'ball' is a sphere; an asset needs a mesh shape"):
        narrow(pipeline_of(others), {"ball": screw["nut"]})
    ordered = newton.CollisionPipeline(model, rigid_contact_max=100, deterministic=True)
    with pytest.raises(ValueError, match="the pipeline is deterministic"):
        narrow(ordered, screw)
    with pytest.raises(ValueError, match="time_step: 0; expected more than 0"):
        tesdf.newton.rigid(0)
