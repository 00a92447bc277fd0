"""Queries a second for 1e4 … 1e7 points in memory of torch, read in place: python3 torch_points.py MESH. Prints JSON."""
import json
import sys
import time

import numpy as np
import tesdf
import torch

asset = tesdf.encode(sys.argv[1])
low, high = (np.asarray(corner) for corner in (asset.bounds[0], asset.bounds[1]))
generator = torch.Generator(device="cuda").manual_seed(1)
scale, base = (torch.tensor(v, dtype=torch.float32, device="cuda") for v in (high - low, low))
rows = []
for count in (10_000, 100_000, 1_000_000, 10_000_000):
    points = torch.rand((count, 3), generator=generator, device="cuda") * scale + base
    torch.cuda.synchronize()
    seconds = []
    for _ in range(8):
        start = time.perf_counter()
        answers = asset.query(points, device="cuda:0")
        seconds.append(time.perf_counter() - start)
    found = torch.from_dlpack(answers.signed_distance)
    some = slice(0, 10_000)
    exact = asset.query(points[some].cpu().numpy().astype(np.float64)).signed_distance
    worst = float(np.abs(found[some].cpu().numpy() - exact).max())
    rows.append({"points": count, "seconds": min(seconds[1:]), "queries_per_second": count / min(seconds[1:]),
                 "largest_difference_from_processor": worst})
print(json.dumps(rows))
