"""Exact signed distances of triangle meshes, in numpy.

    asset = tesdf.encode("part.stl")                   # a path, (vertices, faces), or an object that has both
    answers = asset.query(points)                      # points [N, 3]
    answers.signed_distance, answers.gradient, answers.closest_point, answers.face
    asset.save("part.tesdf")
    asset = tesdf.Asset.open("part.tesdf")             # maps the file; asset.vertices, .faces are views of it

    report = tesdf.check("part.stl")                   # defects by element; report.encodable
    vertices, faces, report = tesdf.repair("part.stl") # says every change
    tesdf.encode((vertices, faces))

    asset = tesdf.encode("beam.stl", domain="gmsh", deformable=True)       # tetrahedra that follow the surface
    asset = asset.move_vertices(ids, positions).asset.reencode_stale().asset

All lengths are in the mesh's unit; ids are 0-based. Errors are `MeshError` (`NotSolidError` when the mesh has no
well-defined inside), `EncodeError`, `DeformError`, `AssetError`, all of them `ValueError`, and `OSError` for files.
"""

from ._native import NO_FACE, Asset, __version__, check, encode, repair
from .errors import AssetError, DeformError, EncodeError, MeshError, NotSolidError
from .reports import CheckReport, Defect, RepairReport, VerifyReport
from .results import Answers, Moved, RayHits, Reencoded, Repaired

__all__ = [
    "NO_FACE",
    "Answers",
    "Asset",
    "AssetError",
    "CheckReport",
    "Defect",
    "DeformError",
    "EncodeError",
    "MeshError",
    "Moved",
    "NotSolidError",
    "RayHits",
    "Reencoded",
    "RepairReport",
    "Repaired",
    "VerifyReport",
    "__version__",
    "check",
    "encode",
    "repair",
]
