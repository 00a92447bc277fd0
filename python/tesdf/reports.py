"""Results of `check`, `repair`, `Asset.inspect` and `Asset.verify`, the metadata of an asset, and
results for pairs of bodies.

Lengths are in the mesh's unit, and ids start from 0. A float that is not finite is NaN.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import typing
from dataclasses import dataclass
from typing import Any, Optional

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Defect:
    """A defect or unusual property of a mesh, and where it is."""

    kind: str
    """such as "open-edge" or "self-intersection" """
    severity: str
    """"error": the mesh cannot be encoded; "warning": may be unintended; "note": has no
    consequence"""
    faces: tuple[int, ...]
    vertices: tuple[int, ...]
    place: Point
    message: str
    """one line for users"""

    def __str__(self) -> str:
        return self.message


@dataclass(frozen=True)
class BoundaryLoop:
    """A chain of edges where the surface is open."""

    vertices: tuple[int, ...]
    closed: bool
    length: float


@dataclass(frozen=True)
class CheckReport:
    """Result of `check`. Its text has the lines of `tesdf check`."""

    vertices: int
    """number of vertices"""
    faces: int
    """number of faces"""
    min: Point
    max: Point
    diagonal: float
    shells: int
    """number of pieces that are connected through edges"""
    boundary_loops: tuple[BoundaryLoop, ...]
    winding: Optional[tuple[int, int]]
    """smallest and largest winding number; None if it is not an integer everywhere"""
    encodable: bool
    """whether the inside is well defined, that is, there is no error"""
    defects: tuple[Defect, ...]
    """sorted by kind, then by position in the mesh"""
    notes: tuple[str, ...]
    """changes made while the file was read"""
    text: str = dataclasses.field(repr=False)

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class SplitEdge:
    """An edge that was split at the vertices that lie on it."""

    edge: tuple[int, int]
    at: tuple[int, ...]
    faces: tuple[int, ...]
    distance: float
    """largest distance of the vertices from the edge"""


@dataclass(frozen=True)
class FilledHole:
    """A hole that was filled with triangles between its vertices."""

    loops: tuple[tuple[int, ...], ...]
    """vertices around the hole; a flat hole may have islands, whose loops follow that of its
    outline"""
    faces: int
    """number of triangles"""
    area: float
    method: str
    """"flat", "minimum-weight", "pieces" or "ears" """


@dataclass(frozen=True)
class HoleLeft:
    """A hole that was to be filled, and stays open."""

    vertices: tuple[int, ...]
    reason: str
    """"too-many-edges", or "one-sided" for a surface like a Moebius strip"""


@dataclass(frozen=True)
class RepairReport:
    """All changes of `repair`, in their order. Ids refer to the given mesh; in `remaining` and
    `warnings` to the result.

    Its text has the lines of `tesdf repair`.
    """

    weld_tolerance: Optional[float]
    """None if vertices were not merged by a tolerance"""
    welded_vertices: tuple[tuple[int, int], ...]
    """merged vertices, each with the vertex that replaces it"""
    collapsed_faces: tuple[int, ...]
    """faces that were removed because two of their corners are equal, or because they have no area and
    stand out of the surface"""
    duplicate_faces: tuple[tuple[int, int], ...]
    """faces that were removed because they repeat another face, with that face"""
    split_edges: tuple[SplitEdge, ...]
    vanished_faces: tuple[int, ...]
    """collinear faces that were removed because their neighbours were split"""
    reversed_faces: tuple[int, ...]
    crossing_shells: tuple[tuple[int, int], ...]
    """shells that intersect others and keep their orientation: one face of each of two shells"""
    paired_edges: tuple[tuple[int, int], ...]
    """edges with more than two faces, which were paired by their angle"""
    filled_holes: tuple[FilledHole, ...]
    holes_left: tuple[HoleLeft, ...]
    unused_vertices: int
    """number of vertices that were removed because no face uses them"""
    encodable: bool
    """whether the mesh can be encoded after the repair"""
    remaining: tuple[Defect, ...]
    """remaining errors"""
    warnings: tuple[Defect, ...]
    notes: tuple[str, ...]
    """changes made while the file was read"""
    text: str = dataclasses.field(repr=False)

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Certificate:
    """What the encoder proved: in every cell with a list, distances are exact up to `delta`."""

    encoder: str
    domain: str
    delta: Optional[float]
    """None if nothing is proved"""
    delta_of_diagonal: Optional[float]
    truncated: bool
    """whether lists were truncated to a maximum length"""
    exactness_distance: Optional[float]
    """distance from the surface up to which every cell is exact; None if every cell is exact
    everywhere"""
    chains: Optional[int]
    """largest weight of a chain of shared features (rule C) in the proof of a list, at most 400;
    None if nothing is proved"""
    inside: Any = None
    """the rule that says what is inside and the faces that are the surface; None is the winding
    number and all faces"""
    jumps: bool = False
    """whether the sign changes in holes of an open mesh, where the distance is not 0"""


@dataclass(frozen=True)
class Repair:
    """A repair of a mesh before it was encoded."""

    flags: str
    """the flags of `tesdf repair` that make the same changes"""
    welded_vertices: int
    dropped_faces: int
    split_edges: int
    reversed_faces: int
    filled_holes: int
    filled_area: float
    """in the mesh's unit, squared"""


@dataclass(frozen=True)
class Source:
    """The file that a mesh was read from; empty for a mesh from memory."""

    name: str
    blake3: str
    repair: Optional[Repair] = None
    """what a repair changed between the file and the mesh"""


@dataclass(frozen=True)
class Statistics:
    """Counts from the encoding. Volumes are in the mesh's unit, cubed."""

    faces: int
    vertices: int
    diagonal: float
    listed_cells: int
    crossing_cells: int
    far_cells: int
    outside_cells: int
    entries: int
    longest_list: int
    domain_volume: float
    far_volume: float
    volume_weighted_list: float


@dataclass(frozen=True)
class Counts:
    """Numbers of faces, vertices, cells and list entries."""

    faces: int
    vertices: int
    listed_cells: int
    crossing_cells: int
    far_cells: int
    outside_cells: int
    depth: int
    entries: int


@dataclass(frozen=True)
class ListLengths:
    """Lengths of the lists, where each cell counts once."""

    mean: float
    p50: int
    p90: int
    p99: int
    longest: int


@dataclass(frozen=True)
class MeanReads:
    """Mean number of faces and nodes that a query reads, and fractions of points or of the
    domain's volume."""

    near_surface: float
    near_surface_fallback: float
    volume_weighted: float
    fallback_volume: float
    fallback: float
    samples: int


@dataclass(frozen=True)
class Memory:
    """Resident memory of an open asset, in bytes."""

    parts: tuple[tuple[str, int], ...]
    """each section of the file, and the tables that are built when it is opened"""
    file: int
    whole: int
    whole_per_face: float
    lists_and_tree: int
    paper: int
    """4 bytes per list entry and 16 per cell with a list"""
    paper_mib: float


@dataclass(frozen=True)
class Classes:
    """Numbers of vertices and tetrahedra of a conforming domain by class. "boundary" tetrahedra
    have a vertex on the surface."""

    surface_vertices: int
    inner_vertices: int
    outer_vertices: int
    boundary_inner_tetrahedra: int
    inner_tetrahedra: int
    boundary_outer_tetrahedra: int
    outer_tetrahedra: int


@dataclass(frozen=True)
class Inspection:
    """Result of `Asset.inspect`."""

    counts: Counts
    classes: Optional[Classes]
    """None in the bisection domain"""
    lists: ListLengths
    reads: MeanReads
    memory: Memory


@dataclass(frozen=True)
class Promise:
    """Promised accuracy of a precision: errors of distances relative to the diagonal, of
    gradients in radians. Where nothing is promised, answers are compared with it all the same."""

    of_diagonal: float
    ulps: float
    gradient: float
    gradient_width: float
    """added to `gradient`: this length divided by the distance; 0 unless the precision treats
    narrow faces as segments"""
    gradient_from: float
    within: Optional[float]
    """distances and gradients are promised up to this distance from the surface; None if
    everywhere"""
    diagonal: float
    largest_coordinate: float


@dataclass(frozen=True)
class Worst:
    """The point with the largest error of an answer."""

    point: Point
    # `class` is a keyword in Python, so the library's field `class` is `kind` here.
    kind: str
    expected: float
    found: float
    face: int


@dataclass(frozen=True)
class ClassErrors:
    """Errors at the points of one kind, such as "near_surface" or "on_edge"."""

    kind: str
    points: int
    largest_error: float


@dataclass(frozen=True)
class PrecisionReport:
    """Comparison of one precision with brute force."""

    precision: str
    passed: bool
    promise: Promise
    largest_error: float
    largest_error_of_diagonal: float
    largest_error_of_promise: float
    worst: Optional[Worst]
    distance_mistakes: int
    """points with a larger error than the bound"""
    sign_mistakes: int
    worst_sign: Optional[Worst]
    gradient_mistakes: int
    largest_gradient_error: float
    worst_gradient: Optional[Worst]
    largest_error_beyond: Optional[float]
    """largest error where none is promised; None if every point has a promise"""
    classes: tuple[ClassErrors, ...]


@dataclass(frozen=True)
class VerifyReport:
    """Result of `Asset.verify`."""

    passed: bool
    """whether no answer was wrong by more than the bounds, where lists are not cut"""
    certified: bool
    """whether the asset promises distances; if not, they are compared all the same"""
    samples: int
    """points, without those inside cells"""
    cell_points: int
    """points inside cells, of an asset that certifies nothing"""
    cells: int
    """cells with such a point"""
    listed_cells: int
    seed: int
    faces: int
    winding_brute_force: int
    winding_disagreements: int
    diagonal: float
    precisions: tuple[PrecisionReport, PrecisionReport]
    """"f32", then "f64" """


@dataclass(frozen=True)
class DetectionStatistics:
    """Counts of a detection."""

    instance_pairs: int
    """ordered pairs of instances whose bounds overlap"""
    candidates: int
    """faces or vertices that remain after the broad phase; with `spread`, this and all
    other numbers count what was looked at"""
    polygons: int
    """pairs of a face and a cell, or of a vertex and its cell; with one contact per face, faces"""
    touching: int
    """contacts within the contact distance"""
    filtered: int
    """contacts that the cosine filter dropped, or that are no local minima where those are wanted"""
    reduced: int
    """contacts that the reduction dropped"""
    unconverged: int
    """contacts whose minimum is not proved to be within the tolerance"""
    bytes: int
    """bytes of all contacts and intermediate products"""


@dataclass(frozen=True)
class Device:
    """A device on which contacts and signed distances can be computed."""

    number: int
    """its number among the devices of this machine, the best first"""
    name: str
    """the name that the driver reports; of CUDA devices it ends with (cuda:0), (cuda:1), ..."""
    kind: str
    """discrete GPU, integrated GPU, virtual GPU, software or other"""
    subgroup_size: tuple[int, int]
    """smallest and largest number of threads that run in lockstep"""
    has_subgroup_operations: bool
    """whether these threads exchange values without shared memory"""
    max_buffer_bytes: int
    """size of the largest buffer"""
    has_timestamps: bool
    """whether the clock of the device measures the time of each stage"""


@dataclass(frozen=True)
class Clearance:
    """Signed distance of two bodies, in the unit and frame of the world."""

    distance: float
    """Positive: the least distance between the surfaces. Negative: the bodies overlap; the lesser of
    the two least signed distances of one surface to the other body. At most the tolerance
    above the true value if `converged`"""
    lower_bound: float
    """the true value is between this and `distance`"""
    point_a: Point
    """witness point on a"""
    point_b: Point
    """witness point on b"""
    normal: Point
    """unit vector from b to a"""
    face_a: int
    face_b: int
    field: int
    """the instance whose signed distance field was used"""
    converged: bool
    """whether the error is within the tolerance"""
    overlap: bool
    """whether the solids share volume, also where their surfaces coincide"""


@dataclass(frozen=True)
class Impact(Clearance):
    """First impact of two moving bodies: the clearance at its time. If it is undecided, the clearance
    at the time up to which they are known to be apart."""

    time: Optional[float]
    """of the impact. None if it is undecided"""
    iterations: int
    """the most steps that a pair of parts of the surfaces took"""
    touches: bool
    """whether the bodies touch at `time`"""
    verdict: str
    """"impact"; or "undecided" when the steps were used up, or rounding is not small relative to the
    tolerance"""
    free_until: float
    """before this time the bodies are apart"""


@dataclass(frozen=True)
class WhyPolygon:
    """A face clipped by a cell, a point of a whole face, or a vertex."""

    cell: Optional[int]
    """None outside of the domain, and in the field of a simple shape"""
    vertices: tuple[Point, ...]
    """corners of the clipped polygon"""
    distance: float
    """least signed distance"""
    point: Point
    """the point with this distance"""
    face_b: int
    verdict: str
    """"contact"; or why it is none: "cell_beyond" and "beyond" the contact distance, "filtered" by
    the cosine, "descending" or "out_of_cones" where local minima are wanted"""
    cosine: Optional[float]
    """of a filtered contact"""


@dataclass(frozen=True)
class WhyPart:
    """A face or vertex of a."""

    id: int
    contact_distance: float
    """at most that of the pair: less where the part hardly moves against b"""
    broad: str
    """"candidate"; or why it was dropped: "pruned_by_tree" or "pruned_by_ball" """
    bound: Optional[float]
    """lower bound of its signed distance, if it was dropped"""
    polygons: tuple[WhyPolygon, ...]


@dataclass(frozen=True)
class WhyReport:
    """Result of `Scene.why`: one ordered pair, before a reduction."""

    instance_a: int
    """the instance that has the faces"""
    instance_b: int
    """the instance whose field is used"""
    pair: str
    """"tested"; or why it was not: "same_instance", "other_worlds", "groups_do_not_meet",
    "excluded", "both_planes", "bounds_apart" or "of_other_order" (the faces of b have all
    contacts: a is a plane, or a convex body and b a ball). The rest is reported as if the
    pair was tested"""
    contact_distance: float
    """that of the options plus what velocities add"""
    bounds_gap: float
    """distance between the bounds; 0 when they overlap"""
    total: int
    """number of faces or vertices of a"""
    candidates: int
    """number of these that the broad phase keeps"""
    parts: tuple[WhyPart, ...]
    """the requested part; without a request, all candidates"""


def from_json(name: str, text: str) -> Any:
    """An object of the class `name` of this module."""
    return _build(globals()[name], json.loads(text))


@functools.lru_cache(maxsize=None)
def _hints(kind: type) -> dict[str, Any]:
    """The types of the fields. A detection asks for them each time, and finding them takes as long as some contacts."""
    return typing.get_type_hints(kind)


def _build(kind: Any, value: Any) -> Any:
    """`value` as an object of type `kind`. Raises TypeError if the fields differ from those of
    the class."""
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        hints = _hints(kind)
        names = {("kind" if key == "class" else key): item for key, item in value.items()}
        return kind(**{key: _build(hints.get(key), item) for key, item in names.items()})
    arguments = typing.get_args(kind)
    if typing.get_origin(kind) is tuple:
        each = arguments[:1] * len(value) if arguments[1:] == (...,) else arguments
        return tuple(map(_build, each, value))
    if type(None) in arguments:
        return None if value is None else _build(arguments[0], value)
    if kind is float:
        return float("nan") if value is None else float(value)
    return value
