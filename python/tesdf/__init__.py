"""Exact signed distances of triangle meshes, in numpy.

    asset = tesdf.encode("part.stl")                   # a path, (vertices, faces), or an object that has both
    answers = asset.query(points)                      # points [N, 3]
    answers.signed_distance, answers.gradient, answers.closest_point, answers.face
    asset.save("part.tesdf")
    asset = tesdf.Asset.open("part.tesdf")             # maps the file; asset.vertices, .faces are views of it

    report = tesdf.check("part.stl")                   # defects by element; report.encodable
    vertices, faces, report = tesdf.repair("part.stl") # says every change
    tesdf.encode((vertices, faces))

All lengths are in the mesh's unit; ids are 0-based. Errors are `MeshError` (`NotSolidError` when the mesh has no
well-defined inside), `EncodeError`, `AssetError`, all of them `ValueError`, and `OSError` for files.
"""

from ._native import NO_FACE, Asset, __version__, check, encode, repair
from .errors import AssetError, EncodeError, MeshError, NotSolidError
from .reports import CheckReport, Defect, RepairReport, VerifyReport
from .results import Answers, RayHits, Repaired

__all__ = [
    "NO_FACE",
    "Answers",
    "Asset",
    "AssetError",
    "CheckReport",
    "Defect",
    "EncodeError",
    "MeshError",
    "NotSolidError",
    "RayHits",
    "RepairReport",
    "Repaired",
    "VerifyReport",
    "__version__",
    "check",
    "encode",
    "repair",
]
