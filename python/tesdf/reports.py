"""What `check`, `repair`, `Asset.inspect` and `Asset.verify` find, and what an asset says of itself.

Lengths are in the mesh's unit, ids are 0-based. A float that left the range of floats is NaN.
"""

from __future__ import annotations

import dataclasses
import json
import typing
from dataclasses import dataclass
from typing import Any, Optional

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Defect:
    """Something about a mesh that a person may want to know, with its place."""

    kind: str
    """such as "open-edge" or "self-intersection" """
    severity: str
    """"error": the mesh cannot be encoded; "warning": worth a look; "note": without consequence"""
    faces: tuple[int, ...]
    vertices: tuple[int, ...]
    place: Point
    message: str
    """one line for people"""

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
    """What `check` found; as text, the lines of `tesdf check`."""

    vertices: int
    """number of vertices"""
    faces: int
    """number of faces"""
    min: Point
    max: Point
    diagonal: float
    shells: int
    """number of pieces that are connected over edges"""
    boundary_loops: tuple[BoundaryLoop, ...]
    winding: Optional[tuple[int, int]]
    """least and greatest winding number; None when it is not an integer everywhere"""
    encodable: bool
    """whether the inside is well defined: there is no error"""
    defects: tuple[Defect, ...]
    """by kind, then by place in the mesh"""
    notes: tuple[str, ...]
    """what reading the file changed"""
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
class RepairReport:
    """Every change of `repair`, in its order; ids are those of the mesh given, in `remaining` and `warnings` of the result.

    As text, the lines of `tesdf repair`.
    """

    welded_vertices: tuple[tuple[int, int], ...]
    """vertices merged, each with the one that took its place"""
    collapsed_faces: tuple[int, ...]
    """faces dropped as two of their corners are equal"""
    duplicate_faces: tuple[tuple[int, int], ...]
    """faces dropped as they repeat another, with that one"""
    split_edges: tuple[SplitEdge, ...]
    vanished_faces: tuple[int, ...]
    """collinear faces that vanished as their neighbours were split"""
    reversed_faces: tuple[int, ...]
    crossing_shells: tuple[tuple[int, int], ...]
    """shells that meet others and keep their orientation: one face of each of two"""
    unused_vertices: int
    """number of vertices dropped as no face uses them"""
    encodable: bool
    """whether the mesh is encodable now"""
    remaining: tuple[Defect, ...]
    """errors left"""
    warnings: tuple[Defect, ...]
    notes: tuple[str, ...]
    """what reading the file changed"""
    text: str = dataclasses.field(repr=False)

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Certificate:
    """What the encoder proved: in every cell with a list, distances are exact up to `delta`."""

    encoder: str
    domain: str
    delta: Optional[float]
    """None: nothing is proved"""
    delta_of_diagonal: Optional[float]
    truncated: bool
    """whether lists were cut to a largest length"""
    exactness_distance: Optional[float]
    """distance from the surface within which every cell is exact; None: everywhere"""
    chains: Optional[int]
    """how much of the budget for rounding the lists have used, of 400; None: nothing is proved"""


@dataclass(frozen=True)
class Source:
    """The file that a mesh came from; empty for a mesh made in memory."""

    name: str
    blake3: str


@dataclass(frozen=True)
class Statistics:
    """Counts taken while encoding; volumes are in the mesh's unit, cubed."""

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
    """How many there are of what."""

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
    """Lengths of the lists, each cell counted once."""

    mean: float
    p50: int
    p90: int
    p99: int
    longest: int


@dataclass(frozen=True)
class MeanReads:
    """Faces and nodes that a query reads on average; shares are of points or of the domain's volume."""

    near_surface: float
    near_surface_fallback: float
    volume_weighted: float
    fallback_volume: float
    fallback: float
    samples: int


@dataclass(frozen=True)
class Memory:
    """What is resident while an asset is open, in bytes."""

    parts: tuple[tuple[str, int], ...]
    """each part of the file, and what opening makes besides"""
    file: int
    whole: int
    whole_per_face: float
    lists_and_tree: int
    paper: int
    """4 bytes for each list entry and 16 for each cell with a list"""
    paper_mib: float


@dataclass(frozen=True)
class Classes:
    """Vertices and tetrahedra of a conforming domain by class; "boundary" tetrahedra have a vertex on the surface."""

    surface_vertices: int
    inner_vertices: int
    outer_vertices: int
    boundary_inner_tetrahedra: int
    inner_tetrahedra: int
    boundary_outer_tetrahedra: int
    outer_tetrahedra: int


@dataclass(frozen=True)
class Inspection:
    """What `Asset.inspect` found."""

    counts: Counts
    classes: Optional[Classes]
    """of a conforming domain"""
    lists: ListLengths
    reads: MeanReads
    memory: Memory


@dataclass(frozen=True)
class Promise:
    """What a precision promises: errors of distances as a share of the diagonal, of gradients in radians."""

    of_diagonal: float
    ulps: float
    gradient: float
    gradient_width: float
    """added to `gradient`: this length over the distance; 0 unless the precision takes narrow faces for segments"""
    gradient_from: float
    within: Optional[float]
    """distances and gradients are promised nearer to the surface than this; None: everywhere"""
    diagonal: float
    largest_coordinate: float


@dataclass(frozen=True)
class Worst:
    """A point where an answer was off."""

    point: Point
    # Keywords cannot be fields: `class` of the library is `kind` here.
    kind: str
    expected: float
    found: float
    face: int


@dataclass(frozen=True)
class ClassErrors:
    """Points of one kind, such as "near_surface" or "on_edge"."""

    kind: str
    points: int
    largest_error: float


@dataclass(frozen=True)
class PrecisionReport:
    """How one precision compares with brute force."""

    precision: str
    passed: bool
    promise: Promise
    largest_error: float
    largest_error_of_diagonal: float
    largest_error_of_promise: float
    worst: Optional[Worst]
    sign_mistakes: int
    worst_sign: Optional[Worst]
    gradient_mistakes: int
    largest_gradient_error: float
    worst_gradient: Optional[Worst]
    largest_error_beyond: Optional[float]
    """where none is promised; None when every point has a promise"""
    classes: tuple[ClassErrors, ...]


@dataclass(frozen=True)
class VerifyReport:
    """What `Asset.verify` found."""

    passed: bool
    """whether every promise was kept"""
    samples: int
    seed: int
    faces: int
    winding_brute_force: int
    winding_disagreements: int
    diagonal: float
    precisions: tuple[PrecisionReport, PrecisionReport]
    """"f32", then "f64" """


def from_json(name: str, text: str) -> Any:
    """An object of the class `name` of this module."""
    return _build(globals()[name], json.loads(text))


def _build(kind: Any, value: Any) -> Any:
    """`value` as an object of type `kind`; a field more or less than the class has is a TypeError."""
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        hints = typing.get_type_hints(kind)
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
