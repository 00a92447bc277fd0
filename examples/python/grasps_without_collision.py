"""Grasps whose fingers cut into a peg are pulled out of it, by the gradient of the clearance.

python examples/python/grasps_without_collision.py    # needs torch
"""

from pathlib import Path

import tesdf
import tesdf.torch
import torch

PARTS = Path(__file__).resolve().parents[2] / "data" / "procedural"
FINGER, PEG = PARTS / "gripper_finger.obj", PARTS / "lobed_peg.obj"  # the peg is 16 mm wide and 40 mm high
COUNT, ROOM, GAP = 16, 1e-3, 12e-3  # grasps; room they should have, half of the open gap, m
LENGTH = 0.02  # a turn of 1 rad counts as this length, m
# The fingers in the frame of the hand, whose origin is between their tips.
FINGERS = torch.tensor([[[-GAP, 0, 0.06, 1, 0, 0, 0]], [[GAP, 0, 0.06, 0, 1, 0, 0]]], dtype=torch.float64)


def rooms(x):
    """The clearances [2, N] of both fingers and the peg, moved by x[:, :3] and turned by x[:, 3:] / LENGTH."""
    half = x[:, 3:] / LENGTH / 2
    pose = torch.cat([x[:, :3], half, torch.ones_like(x[:, :1])], 1)
    return tesdf.torch.clearance(FINGER, PEG, FINGERS, pose)


start = torch.randn(COUNT, 6, dtype=torch.float64, generator=torch.Generator().manual_seed(1)) * 4e-3
start[:, 2] -= 0.02  # the tips are at the middle of the peg
x = start.clone().requires_grad_()
optimiser = torch.optim.Adam([x], lr=3e-4)
colliding = []
for step in range(101):
    room = rooms(x)
    colliding.append(int((room < 0).any(0).sum()))
    if step % 10 == 0:
        print(f"step {step:3}: {colliding[-1]:2} of {COUNT} grasps collide; the least clearance is {room.min() * 1e3:.2f} mm")
    if room.min() > 0.9 * ROOM:
        break
    optimiser.zero_grad()
    torch.relu(ROOM - room).sum().backward()
    optimiser.step()

moved = (x - start)[:, :3].norm(dim=1).max()
print(f"after {step} steps all have {room.min() * 1e3:.2f} mm of room, and none has moved by more than {moved * 1e3:.1f} mm")
assert colliding[0] > COUNT / 4 and room.min() > ROOM / 2
