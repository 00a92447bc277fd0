"""A tilted peg that cuts into its hole finds the pose with the most room, by the gradient of the clearance.

python examples/python/peg_finds_hole.py    # needs torch
"""

from pathlib import Path

import tesdf
import tesdf.torch
import torch

PARTS = Path(__file__).resolve().parents[2] / "data" / "procedural"
PEG, HOLE = PARTS / "lobed_peg.obj", PARTS / "lobed_hole_c100.obj"  # 100 µm of room
DEPTH, LENGTH = 0.018, 0.01  # height of the end of the peg, 12 mm below the rim; a turn of 1 rad counts as this length, m


def pose(x):
    """The pose of the peg: moved across by x[:2], and turned by x[2:] / LENGTH."""
    half = x[2:] / LENGTH / 2
    return torch.cat([x[:2], torch.tensor([DEPTH], dtype=x.dtype), half, torch.ones(1, dtype=x.dtype)])


x = torch.tensor([3e-4, -2e-4, 2e-4, -1e-4, 5e-4], dtype=torch.float64, requires_grad=True)
best, optimiser = -torch.inf, torch.optim.Adam([x], lr=5e-5, betas=(0.9, 0.99))
for k in range(201):
    room = tesdf.torch.clearance(PEG, HOLE, pose(x), tolerance=1e-8)
    best = max(best, room.item())
    if k % 40 == 0:
        print(f"step {k:3}: {room.item() * 1e6:7.1f} µm of room")
    optimiser.zero_grad()
    (-room).backward()
    optimiser.step()
    optimiser.param_groups[0]["lr"] *= 0.975  # room is largest at a kink, where steps of one length go to and fro

straight = tesdf.clearance(PEG, HOLE, [0, 0, DEPTH, 0, 0, 0, 1]).distance
print(f"best: {best * 1e6:.1f} µm; straight in the middle of the hole there are {straight * 1e6:.1f} µm")
assert best > 0.9 * straight > 0
