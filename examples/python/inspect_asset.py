"""Looks into an asset with numpy: its mesh, its lists, its bytes, and what its distances say.

python examples/python/inspect_asset.py
"""

from pathlib import Path

import numpy as np
import tesdf

PARTS = Path(__file__).resolve().parents[2] / "data" / "procedural"
asset = tesdf.encode(PARTS / "l_bracket.obj", "fast", unit="m")

# The mesh: views of the asset's memory, without a copy.
corners = asset.vertices[asset.faces]  # [F, 3, 3]
a, b, c = corners.transpose(1, 0, 2)
area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
print(f"{len(asset.faces)} faces, {len(asset.vertices)} vertices: {area * 1e4:.3f} cm², {volume * 1e6:.3f} cm³")

# The lists: how many faces a query compares, by the volume of the cells.
statistics = asset.statistics
print(
    f"{statistics.listed_cells} cells with a list: {statistics.volume_weighted_list:.1f} faces on average, "
    f"at most {statistics.longest_list}; {asset.certificate.delta:.1e} m of error, proved"
)

# The file: all sections are arrays, with and without this package (safetensors.safe_open).
sections = sorted(asset.sections.items(), key=lambda section: -section[1].nbytes)
for name, array in sections[:4]:
    print(f"  {array.nbytes:8,d} bytes  {name} {array.dtype}{list(array.shape)}")

# The distances: as brute force has them, and with the inside where the mesh has it.
points = np.random.default_rng(1).uniform(*asset.bounds, size=(200_000, 3))
answers = asset.query(points)
to_closest = np.linalg.norm(points - answers.closest_point, axis=1)
inside = (answers.signed_distance < 0).mean() * np.ptp(asset.bounds, axis=0).prod()
print(f"the volume by {len(points):,} random points: {inside * 1e6:.3f} cm³")
print(f"deepest point inside: {-answers.signed_distance.min() * 1e3:.3f} mm below the surface")

assert np.allclose(np.abs(answers.signed_distance), to_closest, rtol=0, atol=1e-12)
assert abs(inside / volume - 1) < 0.02
assert asset.verify(samples=1000).passed
