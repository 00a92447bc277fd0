"""Contacts that stay on a CUDA device in Newton. Run by .ci/python.sh beside Newton, with the stand-in for CUDA:
Warp's arrays are on the processor, whose memory is that of the stand-in."""

import newton
import numpy as np
import pytest
import tesdf
import tesdf.newton
from test_newton import STEP, model_of, pipeline_of
from unoptimised_kernels import unoptimised

unoptimised()


@pytest.fixture
def by_newton(monkeypatch):
    """Takes the place of Newton's narrow phase: one contact for each pair that is not ours."""

    def of_newton(self, **arguments):
        arguments["writer_data"].contact_count.fill_(int(arguments["candidate_pair_count"].numpy()[0]))

    monkeypatch.setattr(newton.geometry.NarrowPhase, "launch_custom_write", of_newton)


def collided(screw, room, **options):
    model = model_of(screw, 2, with_ball=True)
    # Margins move the points along the normal.
    model.shape_margin.assign(np.linspace(0, 1e-5, model.shape_count).astype(np.float32))
    pipeline = pipeline_of(model, room)
    pipeline.narrow_phase = tesdf.newton.NarrowPhase(pipeline, screw, contact_distance=2e-4, **options)
    contacts, state = pipeline.contacts(), model.state()
    velocities = state.body_qd.numpy()
    velocities[0] = [0, 0.01, -0.02, 0, 0, 3]
    state.body_qd.assign(velocities)
    pipeline.collide(state, contacts, dt=STEP)
    return pipeline.narrow_phase, contacts


NAMES = ["shape0", "shape1", "point0", "point1", "offset0", "offset1", "margin0", "margin1", "normal"]


def test_contacts_stay_on_cuda(screw, by_newton, monkeypatch):
    assert any("CUDA on the CPU" in device.name for device in tesdf.devices())
    of_host, expected = collided(screw, 40_000)
    monkeypatch.setattr(tesdf.newton, "cuda_number", lambda device: 0)
    there, found = collided(screw, 40_000, device="cuda:0")
    assert type(of_host.last) is tesdf.Contacts and type(there.last) is tesdf.DeviceContacts
    sides = []
    for contacts in (expected, found):
        count = int(contacts.rigid_contact_count.numpy()[0])
        rows = [getattr(contacts, f"rigid_contact_{name}").numpy()[2:count].reshape(count - 2, -1) for name in NAMES]
        sides.append(np.hstack(rows).astype(float))
    # Each vertex is in one contact. At the contact distance itself one may be on one side only.
    assert min(map(len, sides)) > 4000 and abs(len(sides[0]) - len(sides[1])) < 10
    names = [np.hstack([side[:, :2], side[:, 5:8]]) for side in sides]
    apart = np.abs(names[0][:, None] - names[1][None]).max(axis=2)
    nearest = apart.argmin(axis=1)
    both = apart.min(axis=1) < 1e-7
    assert both.sum() > len(both) - 10 and len(set(nearest[both])) == both.sum()
    off = np.abs(sides[0] - sides[1][nearest])[both]
    assert (off[:, :2] == 0).all() and (off[:, 14:16] < 1e-9).all()
    # Where two faces are equally near, each side has point and normal of one of them.
    for columns, bound in ((slice(2, 5), 1e-6), (slice(8, 14), 1e-9), (slice(16, 19), 1e-3)):
        assert (off[:, columns] < bound).all(axis=1).mean() > 0.99, columns
    assert np.abs(of_host.scene.instances.poses - there.scene.instances.poses)[:, :3].max() < 1e-8


def test_what_does_not_fit_is_an_error(screw, by_newton, monkeypatch):
    monkeypatch.setattr(tesdf.newton, "cuda_number", lambda device: 0)
    with pytest.raises(ValueError, match=r"contacts, but the pipeline has room for 500; give CollisionPipeline rigid_contact_max="):
        collided(screw, 500, device="cuda:0")


def test_other_forms_are_copied(screw, by_newton, monkeypatch):
    """Contacts that only the processor can choose."""
    monkeypatch.setattr(tesdf.newton, "cuda_number", lambda device: 0)
    narrow_phase, _ = collided(screw, 40_000, device="cuda:0", mode="exact", contacts_per="minimum")
    assert type(narrow_phase.last) is tesdf.Contacts and len(narrow_phase.last) > 0
