"""Signed distances over all faces, in numpy alone."""

import numpy as np


def closest_points(p, a, b, c):
    """of triangles a b c [F, 3] to a point: by the face's plane where its foot is inside, otherwise by the three edges"""
    normal = np.cross(b - a, c - a)
    best = np.full(a.shape, np.inf)
    for s, t in ((a, b), (b, c), (c, a)):
        along = t - s
        share = ((p - s) * along).sum(1) / (along * along).sum(1)
        foot = s + np.clip(share, 0, 1)[:, None] * along
        nearer = ((p - foot) ** 2).sum(1) < ((p - best) ** 2).sum(1)
        best[nearer] = foot[nearer]
    height = ((p - a) * normal).sum(1) / (normal * normal).sum(1)
    foot = p - height[:, None] * normal
    sides = [(np.cross(t - s, foot - s) * normal).sum(1) for s, t in ((a, b), (b, c), (c, a))]
    inside = np.min(sides, 0) >= 0
    best[inside] = foot[inside]
    return best


def winding_number(p, a, b, c):
    """sum of the solid angles (van Oosterom and Strackee 1983) over 4 pi"""
    a, b, c = a - p, b - p, c - p
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    dot = lambda x, y: (x * y).sum(1)  # noqa: E731
    over = dot(a, np.cross(b, c))
    under = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
    return np.arctan2(over, under).sum() / (2 * np.pi)


def signed_distances(mesh, points):
    """distances, closest points and winding numbers"""
    vertices, faces = mesh
    corners = [vertices[faces[:, k]] for k in range(3)]
    distances, closest, winding = [], [], []
    for p in points:
        candidates = closest_points(p, *corners)
        squared = ((p - candidates) ** 2).sum(1)
        closest.append(candidates[squared.argmin()])
        winding.append(winding_number(p, *corners))
        distances.append(np.sqrt(squared.min()) * (-1 if winding[-1] > 0.5 else 1))
    return np.array(distances), np.array(closest), np.array(winding)
