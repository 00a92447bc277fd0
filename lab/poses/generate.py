#!/usr/bin/env python3
"""Pairs of meshes and the poses at which contacts are benchmarked. Own work, CC0. numpy only, seeded.

    python generate.py [OUTDIR]      (default: beside this file)

One JSON file a set: `a` and `b` name meshes, relative to the file, `contact_distance` is a length in the meshes' unit, and each of
`poses` has the pose of `a` and of `b` as "tx ty tz qx qy qz qw" (translation in the meshes' unit, unit quaternion, mesh to world).
Half of the poses of the fitted sets lie within the clearance, half go beyond it. A common random pose of the world keeps either
mesh from being aligned with the axes.
"""
import json
import os
import sys
import zlib

import numpy as np

COUNT = 20
MM = 1e-3
UM = 1e-6


# ------------------------------------------------------------------ rigid motions, as (quaternion xyzw, translation)
def turn(axis, angle):
    """rotation about an axis through the origin"""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    return np.append(axis * np.sin(angle / 2), np.cos(angle / 2)), np.zeros(3)


def shift(x, y, z):
    return np.array([0, 0, 0, 1.0]), np.array([x, y, z], float)


def rotate(q, v):
    u, w = q[:3], q[3]
    return v + 2 * np.cross(u, np.cross(u, v) + w * v)


def chain(*motions):
    """the last one acts first"""
    q, t = motions[-1]
    for p, s in reversed(motions[:-1]):
        t = s + rotate(p, t)
        xyz = p[3] * q[:3] + q[3] * p[:3] + np.cross(p[:3], q[:3])
        q = np.append(xyz, p[3] * q[3] - p[:3] @ q[:3])
        q = q / np.linalg.norm(q)
    return q, t


def about(centre, motion):
    """the motion with this point as its origin"""
    centre = np.asarray(centre, float)
    return chain(shift(*centre), motion, shift(*-centre))


def random_turn(rng):
    q = rng.normal(size=4)
    return q / np.linalg.norm(q), np.zeros(3)


def across(rng):
    """a unit vector in the x-y plane"""
    phi = rng.uniform(0, 2 * np.pi)
    return np.array([np.cos(phi), np.sin(phi), 0])


def sign(rng):
    return rng.choice([-1.0, 1.0])


# ------------------------------------------------------------------ how much of the clearance is used up, and by what
def shares(rng, i, ways):
    """signed shares of the clearance for each way to use it up: together at most 0.8 for even i, one alone 1.5 to 3 for odd i"""
    if i % 2 == 0:
        return rng.dirichlet(np.ones(ways)) * rng.uniform(0, 0.8)
    use = np.zeros(ways)
    use[i // 2 % ways] = rng.uniform(1.5, 3)
    return use


def nut(rng, i, radial_gap):
    """threaded on at any height: along the axis, across it, tilted about the nut's middle"""
    gap = radial_gap / 2  # normal to a 60 degree flank, at 30 degrees to the axis
    z = rng.uniform(0.5, 10) * MM
    along, sideways, tilt = shares(rng, i, 3)
    off = across(rng) * sideways * gap / 0.5
    reach = np.hypot(6.5, 8) * MM
    loose = chain(
        shift(off[0], off[1], sign(rng) * along * gap / 0.866),
        about([0, 0, z + 6.5 * MM], turn(across(rng), tilt * gap / reach)),
    )
    return chain(loose, shift(0, 0, z), turn([0, 0, 1], 2 * np.pi * z / (2 * MM)))


def peg(rng, i):
    """in its hole at any depth: across, twisted, tilted about the middle of what is in the hole (z 10 to 30 mm)"""
    gap = 100 * UM
    sideways, twist, tilt = shares(rng, i, 3)
    off = across(rng) * sideways * gap
    return chain(
        shift(off[0], off[1], (10 + rng.uniform(-4, 4)) * MM),
        turn([0, 0, 1], sign(rng) * twist * gap / (8 * MM * 0.22)),  # lobes: 3 * 0.6 mm / 8 mm of slope
        about([0, 0, 10 * MM], turn(across(rng), tilt * gap / (10 * MM))),
    )


def gear(rng, i, angle):
    """in mesh with one at the origin that is turned by `angle`: closer or further, turned, tilted; shifted along the axis"""
    gap = 49 * UM
    closer, turned, tilt = shares(rng, i, 3)
    return chain(
        shift(40 * MM - closer * gap / np.sin(np.radians(20)), 0, rng.uniform(-3, 3) * MM),
        turn([0, 0, 1], np.radians(9) - angle + sign(rng) * turned * gap / (20 * MM * np.cos(np.radians(20)))),
        about([0, 0, 6 * MM], turn(across(rng), tilt * gap / (6 * MM))),
    )


def chain_link(rng, i):
    """through another link and pulled along x, until the wires (2.5 mm) nearly touch at 29 mm or are pressed into each other"""
    pull = -rng.uniform(0.02, 0.3) if i % 2 == 0 else rng.uniform(0.05, 0.6)
    wobble = chain(*(turn(axis, np.radians(rng.uniform(-8, 8))) for axis in np.eye(3)))
    at_bend = about([-17 * MM, 0, 0], wobble)
    return chain(shift((29 + pull) * MM, 0, 0), at_bend, turn([1, 0, 0], np.pi / 2))


def cow(rng):
    """any orientation, near enough to overlap more often than not"""
    direction = rng.normal(size=3)
    return chain(shift(*(direction / np.linalg.norm(direction) * rng.uniform(0.3, 1.2))), random_turn(rng))


# ------------------------------------------------------------------ sets
def fitted(place):
    """only `a` is placed; `b` is at the origin before the world turns"""
    return lambda rng, i: (place(rng, i), shift(0, 0, 0))


def gears(rng, i):
    angle = rng.uniform(0, np.radians(18))
    return gear(rng, i, angle), turn([0, 0, 1], angle)


BOLT = "../../data/procedural/iso_m16_bolt_24k.obj"
GEAR = "../../data/procedural/spur_gear_m2_z20.obj"
LINK = "../../data/procedural/chain_link.obj"
SETS = {
    **{f"nut_c{c}_on_bolt": (f"../../data/procedural/iso_m16_nut_c{c}.obj", BOLT, 1e-4,
                             fitted(lambda rng, i, c=c: nut(rng, i, c * UM))) for c in (100, 50, 25)},
    "peg_in_hole": ("../../data/procedural/lobed_peg.obj", "../procedural/lobed_hole_c100.obj", 1.5e-4, fitted(peg)),
    "gears": (GEAR, GEAR, 1e-4, gears),
    "chain_links": (LINK, LINK, 1e-4, fitted(chain_link)),
    "spots": ("../../data/public/spot.obj", "../public/spot.obj", 0.01, fitted(lambda rng, i: cow(rng))),
}


def text(motion):
    q, t = motion
    return " ".join(repr(float(x)) for x in (*t, *q))


def main(out):
    for name, (a, b, contact_distance, place) in SETS.items():
        rng = np.random.default_rng(zlib.crc32(name.encode()))
        poses = []
        for i in range(COUNT):
            world = chain(shift(*rng.uniform(-0.1, 0.1, 3)), random_turn(rng))
            poses.append({key: text(chain(world, m)) for key, m in zip("ab", place(rng, i))})
        with open(os.path.join(out, name + ".json"), "w") as file:
            json.dump(dict(a=a, b=b, contact_distance=contact_distance, poses=poses), file, indent=1)
            file.write("\n")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else os.path.dirname(os.path.abspath(__file__)))
