"""Random pushes on all machines of a Ray cluster, or on all processors of this one: each processor has an actor
with 256 worlds.

python examples/python/ray_worlds.py
"""

import numpy as np
import ray
import tesdf

WORLDS, STEPS = 256, 20
TABLE = {"name": "table", "shape": tesdf.Plane(), "fixed": True, "friction": 1}
BOX = {"name": "box", "shape": tesdf.Box((0.03, 0.02, 0.015)), "mass": 0.3, "friction": 0.09, "translation": [0, 0, 0.015]}
SCENE = {"time_step": 5e-3, "duration": 1, "bodies": [TABLE, BOX]}  # a mesh as (vertices, faces), or an Asset, goes too


@ray.remote(num_cpus=1)
class Rollouts:
    def __init__(self):
        self.worlds = tesdf.Worlds(SCENE, WORLDS, threads=1)  # as many as num_cpus

    def run(self, seed):
        """Masses [WORLDS] and ways [WORLDS, 3] of the boxes."""
        random = np.random.default_rng(seed)
        mass = random.uniform(0.1, 0.6, WORLDS)
        self.worlds.reset()
        self.worlds.set_mass("box", mass)
        self.worlds.set_wrench("box", force=random.normal(0, 1, (WORLDS, 3)) * [1, 1, 0])
        before = self.worlds.poses[:, 1, :3]
        self.worlds.step(STEPS)
        return mass, self.worlds.poses[:, 1, :3] - before


if __name__ == "__main__":
    ray.init()
    actors = [Rollouts.remote() for _ in range(int(ray.cluster_resources()["CPU"]))]
    results = ray.get([actor.run.remote(seed) for seed, actor in enumerate(actors)])
    mass, way = map(np.concatenate, zip(*results))
    far = np.linalg.norm(way, axis=1)
    print(f"{len(far)} worlds; the boxes moved by up to {far.max() * 1e3:.1f} mm, {(far < 1e-6).mean():.0%} of them stuck")
    # Light boxes are moved, heavy ones stick.
    assert far[mass < 0.2].mean() > 2 * far[mass > 0.5].mean() and 0 < (far < 1e-6).mean() < 1
    # The same seed gives the same bytes in any actor, whatever it did before.
    mass, way = ray.get(actors[-1].run.remote(0))
    assert way.tobytes() == results[0][1].tobytes()
