"""Exact signed distances of triangle meshes, in numpy.

    asset = tesdf.encode("part.stl")                    # a path, (vertices, faces), or a mesh
    answers = asset.query(points)                       # points [N, 3]
    answers.signed_distance, answers.gradient, answers.closest_point, answers.face
    asset.save("part.tesdf")
    asset = tesdf.Asset.open("part.tesdf")              # maps the file; asset.faces is a view of it

    report = tesdf.check("part.stl")                    # defects, positions; report.encodable
    vertices, faces, report = tesdf.repair("part.stl")  # reports every change
    tesdf.encode((vertices, faces))

    # Tetrahedra that conform to the surface can follow its vertices.
    asset = tesdf.encode("beam.stl", domain="gmsh", deformable=True)
    asset = asset.move_vertices(ids, positions).asset.reencode_stale().asset

All lengths are in the mesh's unit, and all ids start from 0. Errors are `MeshError`
(`NotSolidError` if the mesh has no well-defined inside), `EncodeError`, `DeformError` and
`AssetError`, which are all `ValueError`s, and `OSError` for files.
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
