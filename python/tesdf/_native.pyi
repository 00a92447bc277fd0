from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, Protocol, Union, final, overload

import numpy as np
import numpy.typing as npt

from .bodies import Body, Mesh, Shape
from .contacts import (
    Clearances,
    CoarseContacts,
    ContactForces,
    ContactPatches,
    ContactRows,
    Contacts,
    DeviceContacts,
    Impacts,
    Instances,
    JointForces,
    Record,
    StepContacts,
    TouchingFeatures,
)
from .planning import MotionCheck, MotionChecks, RobotClearance, RobotClearances
from .playback import LiveView
from .reports import (
    Certificate,
    CheckReport,
    Clearance,
    Device,
    Impact,
    Inspection,
    Source,
    Statistics,
    VerifyReport,
    WhyReport,
)
from .results import Answers, DeviceAnswers, Moved, RayHits, Reencoded, Repaired

class _ContactParameters(Protocol):
    @property
    def condim(self) -> npt.NDArray[Any]: ...
    @property
    def friction(self) -> npt.NDArray[Any]: ...
    @property
    def solref(self) -> npt.NDArray[Any]: ...
    @property
    def solimp(self) -> npt.NDArray[Any]: ...

_Path = Union[str, PathLike[str]]
_Precision = Literal["f64", "f32"]
_Numbers = Union[float, npt.ArrayLike]
_Integers = Union[int, npt.ArrayLike]

_Device = Union[str, int, None]

__all__ = [
    "NO_CELL",
    "NO_FACE",
    "Asset",
    "DeviceArray",
    "InstancePairs",
    "PatchTracker",
    "Robot",
    "Scene",
    "Simulation",
    "Snapshot",
    "Worlds",
    "__version__",
    "asset_of",
    "check",
    "contact_frames",
    "devices",
    "encode",
    "export",
    "fill_mujoco_contacts",
    "import_json",
    "pair",
    "polygons",
    "pose",
    "repair",
    "view",
]

NO_CELL: int
NO_FACE: int
__version__: str

def polygons(
    points: npt.ArrayLike, counts: npt.ArrayLike, corners: npt.ArrayLike
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32], tuple[str, ...]]:
    """Welds equal points and splits polygons into triangles, as reading a file does.

    - points: [N, 3].
    - counts: number of corners of each polygon.
    - corners: ids of the points of all polygons.

    Returns (vertices [V, 3], faces [F, 3], notes). Raises MeshError if an id or a point is wrong."""
def asset_of(mesh: Mesh) -> Asset:
    """The asset of a mesh: an Asset as it is, that of a file .tesdf, or what encode makes with the
    preset "fast" of any other argument of it. A mesh that was encoded before is found by its content,
    among the last 32 of this process or in the user's folder for caches (TESDF_CACHE).

    Errors are those of encode and Asset.open."""
def check(mesh: Mesh) -> CheckReport:
    """Checks a mesh for defects: those that prevent a well-defined inside, and those that may be
    unintended.

    mesh: a path (STL, OBJ, PLY, OFF, glTF, GLB, 3MF; STEP, IGES, BREP with Gmsh; USD with
    usd-core), a pair (vertices [V, 3], faces [F, 3]), or a mesh of trimesh, Open3D or pyvista.

    Raises OSError or MeshError if the mesh cannot be read. Defects are in the report and raise
    nothing."""
def contact_frames(normals: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """The frames of contacts in MuJoCo, [N, 3, 3]: each normal [N, 3], and two directions that make a
    right-handed frame with it."""
def fill_mujoco_contacts(
    fields: Any,
    start: int,
    contacts: ContactRows,
    geoms: npt.ArrayLike,
    parameters: Callable[[npt.NDArray[np.int64], npt.NDArray[np.int64]], _ContactParameters],
) -> None:
    """Writes contacts into the rows of `data.contact` of MuJoCo from `start` on.

    - fields: `data.contact`. Its arrays are written in place, whatever their strides. No other
      thread may use the data meanwhile.
    - start: the row of the first contact.
    - contacts: Contacts of Scene.detect, in the frame and unit of the model.
    - geoms: the geom of each instance, [G].
    - parameters: is called once, with the first and the second geoms of the kinds of contacts, [K]
      and [K], int64. It returns an object with condim [K], friction [K, 5], solref [K, 2] and
      solimp [K, 5].

    A contact gets the middle of its two points as `pos`, and the geom of instance_b as its first
    one, because MuJoCo's normal points from the first geom to the second one. `includemargin` and
    all that MuJoCo's solver fills in are 0, `efc_address` and the ids of flexes are -1.

    Raises ValueError if an array has another type or shape, lacks rows or cannot be written.
    Nothing has been written then."""
def devices() -> list[Device]:
    """The devices of this machine, the best first: a list of Device, whose number or a part of whose
    name is an argument device. Empty where the package was built without the GPU."""
def repair(
    mesh: Mesh,
    *,
    weld_tolerance: float | Literal["auto"] | None = None,
    orient: bool = False,
    fill_holes: bool | int | None = None,
) -> Repaired:
    """Makes a mesh encodable, and reports every change. Without keywords, it changes a mesh only where
    the repair is unique.

    mesh: as for check. weld_tolerance: maximum distance of vertices that are merged, in the mesh's
    unit; "auto" is the smallest of 1e-7 to 1e-4 of the diagonal that closes the cracks; None merges
    none. orient: turns all closed shells outward, or inward if they are cavities, also shells that
    meet others. fill_holes: True fills all holes with triangles between their vertices, a number
    only holes with at most this number of edges.

    Returns Repaired(vertices, faces, report). A mesh that cannot be encoded after the repair is not
    an error: the report gives the reason. Raises OSError or MeshError if the mesh cannot be read or
    no face remains."""
def encode(
    mesh: Mesh,
    preset: Literal["default", "fast", "compact", "gpu", "paper", "sampled-safe"] = "default",
    *,
    domain: Literal["bisection", "gmsh"] | _Path | None = None,
    encoder: Literal["certified", "sampled"] | None = None,
    resolution: int | None = None,
    threshold: float | str | None = None,
    e_max: int | None = None,
    deformable: bool = False,
    plain: bool = False,
    band: float | None = None,
    regions: Sequence[Sequence[float]] | None = None,
    unit: str | None = None,
    inside: Literal["winding", "nonzero", "odd", "generalized", "sheet"] = "winding",
    thickness: float | None = None,
    surface: Literal["all", "boundary"] = "all",
    repair: Literal["auto"] | None = None,
    threads: int | None = None,
    progress: Callable[[str, float], object] | None = None,
) -> Asset:
    """Encodes a closed mesh. Ctrl-C ends it with KeyboardInterrupt.

    - mesh: a path (STL, OBJ, PLY, OFF, glTF, GLB, 3MF; STEP, IGES, BREP with Gmsh; USD with
      usd-core), a pair (vertices [V, 3], faces [F, 3]), or a mesh of trimesh, Open3D or pyvista.
    - preset: "default" (fast queries), "fast" (fast encoding), "compact" (small) or "gpu" (few
      cells, whose lists fill the 32 threads of a GPU that read them), all exact; "paper" (the
      paper's encoder: sampled, 129 samples along an edge, plain) or "sampled-safe" (sampled with a
      threshold that is large enough that no needed face is missing).
    - domain: the division of space into tetrahedra. None or "bisection" needs no other program.
      "gmsh" runs Gmsh (the program of that name, or the one in the environment variable
      TESDF_GMSH). A path (.msh, .node, .ele) has tetrahedra that conform to the mesh's faces.
    - encoder: the method that finds the closest faces of each tetrahedron: "certified" (proven) or
      "sampled" (as in the paper; faces that are closest only between samples may be missing). None
      is the encoder of the preset.
    - resolution: an edge of a tetrahedron has resolution + 1 samples. None is 32, or the value of
      the preset.
    - threshold: a face is listed if it is at most this length farther than the closest face at a
      sample, in the mesh's unit. "squared:1e-6" compares squared distances instead, in the squared
      unit. "safe" is large enough that no needed face is missing.
    - e_max: maximum length of a list; the faces that are needed nearest to the surface stay.
    - deformable: prepares the lists for moving vertices; needs a conforming domain ("gmsh" or a
      path).
    - plain: keeps the tetrahedra of a conforming domain as they are, without bisecting them.
    - band: width of the encoded layer around the solid, in the mesh's unit. None is 5 % of the
      diagonal, and no layer with "gmsh".
    - regions: boxes [R, 6] that are encoded as well, each min x y z, max x y z.
    - unit: name of the mesh's unit; it is recorded in the asset and scales nothing. None is the
      unit of the file, if it has one; another unit than that is a warning.
    - inside: the rule that says what is inside. "winding": a winding number of 1 or more,
      "nonzero": other than 0, "odd": odd; these need a closed mesh. "generalized": a generalised
      winding number of 1/2 or more in absolute value; for open meshes. "sheet": nearer to a face
      than half of the thickness; for any faces.
    - thickness: that of a sheet, in the mesh's unit.
    - surface: the faces to which distances refer: "all", or "boundary", the faces between inside
      and outside.
    - repair: "auto" repairs a mesh without a well-defined inside before it is encoded: the first of
      these that makes it encodable, duplicates and T-junctions and orientation, welding of cracks,
      filling of holes. The asset records what was changed (asset.source.repair). None refuses such
      a mesh.
    - threads: number of threads, at most 1024; None is one per core. The bytes of the asset do not depend on it.
    - progress: called with the stage ("refine", "tighten", "assemble") and the completed fraction
      of it, 0 to 1, about twenty times a second. An exception from it ends the encoding and is
      raised.

    Raises OSError or MeshError if the mesh or the tetrahedra cannot be read. Raises NotSolidError
    if the mesh has no well-defined inside. Raises EncodeError if an option does not apply to the
    mesh, options exclude each other, Gmsh fails, or the tetrahedra do not conform to the mesh."""
def import_json(path: _Path) -> Asset:
    """Reads a JSON file of TES-Encoder, the program of the paper's authors: a surface, tetrahedra that
    conform to it, and their lists.

    The lists stay as they are, and nothing is proved of them: the asset's certificate has no delta.
    `tesdf verify --prove` proves them, or shows where a list misses a face. Surface and tetrahedra
    are checked, as encode does.

    Raises OSError if the file cannot be read. Raises MeshError, which names the key and the place in
    its array, if a value does not fit or the tetrahedra do not conform to the surface, and
    NotSolidError if the surface has no well-defined inside."""
@final
class Asset:
    @staticmethod
    def open(path: _Path) -> Asset:
        """Maps the file and checks the structure that queries rely on. verify also reads every byte.

        The file must not be changed in place while the asset exists; replacing it, as save does, is
        safe. Raises OSError if the file cannot be read, and AssetError if it is not an asset."""
    @staticmethod
    def from_bytes(data: bytes) -> Asset:
        """As open, but from the bytes of a file."""
    def to_bytes(self) -> bytes:
        """The bytes of the whole file. After move_vertices, call reencode_stale first: the file does
        not record which lists are stale."""
    def save(self, path: _Path) -> None:
        """Writes the file with the bytes of to_bytes. An existing file is replaced in one step and
        keeps its permissions. A read-only file raises PermissionError."""
    def export_json(self, path: _Path) -> None:
        """Writes a JSON file of TES-Encoder, the program of the paper's authors, which import_json reads.

        The asset must have a conforming domain: encode with domain="gmsh" or a file of tetrahedra,
        and with plain=True if each tetrahedron should be one cell; otherwise a tetrahedron gets the
        faces of all of its cells. Raises EncodeError for the bisection domain, and OSError if the
        file cannot be written."""
    @overload
    def query(self, points: DeviceArray, precision: _Precision = "f64", *, device: _Device = "cpu") -> DeviceAnswers:
        """Signed distance, gradient, closest point and face for each of the points [N, 3]. Of one point
        [3], answers have no axis of points; a device takes [N, 3] only.

        With precision "f64" the mesh is used as given, and exact predicates decide the signs. "f32"
        is several times faster and exact to 1e-6 of the diagonal. A point that is not finite gets
        NaN and NO_FACE.

        device: "cpu", "gpu" (what TESDF_DEVICE names, else the best device), or the number of a
        device or a part of its name, such as "cuda:0" (devices lists them). A device computes in
        f32, exact to 2e-6 of the diagonal, whatever precision says. It keeps the asset until a
        query on another device. Points that are on the device, as a DeviceArray or float32 of
        torch, warp or cupy on a CUDA device, are read in place, and the answers stay there:
        DeviceAnswers."""
    @overload
    def query(self, points: npt.ArrayLike, precision: _Precision = "f64", *, device: _Device = "cpu") -> Answers: ...
    def query_in_domain(self, points: npt.ArrayLike, precision: _Precision = "f64") -> Answers:
        """As query, but with NaN and NO_FACE for points outside of the encoded domain. The domain ends
        at the width of the band from the solid, up to about the size of a cell."""
    def signed_distance(self, points: npt.ArrayLike, precision: _Precision = "f64") -> npt.NDArray[np.float64]:
        """Only the signed distances [N], negative inside; of one point [3] a number."""
    def is_inside(self, points: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether each of the points [N, 3] is inside, by exact predicates; of one point [3] a truth
        value. Points on the surface may count as inside or outside."""
    def ray_cast(self, origins: npt.ArrayLike, directions: npt.ArrayLike, limit: float = ...) -> RayHits:
        """The first face that each ray meets, from either side: RayHits(t, point, face, normal).

        origins and directions have the shape [N, 3], or [3] for a value that all rays share. t is
        in lengths of the direction and at most limit. A ray that meets no face has t = inf, NaN and
        NO_FACE."""
    def move_vertices(self, vertices: npt.ArrayLike, positions: npt.ArrayLike) -> Moved:
        """The asset with the vertices [N] moved to the positions [N, 3]: Moved(asset, faces,
        tetrahedra, inverted). Needs a conforming domain.

        The first ids are the mesh's vertices in their order; those of the domain's own vertices
        (sections["domain.vertices"]) follow. Tetrahedra and lists stay the same. Distances are then
        distances to the listed faces in their new positions, and nothing is proved about them until
        reencode_stale. This asset does not change.

        Raises DeformError in the bisection domain, and for ids and positions that are not valid."""
    def stale_cells(self) -> npt.NDArray[np.uint32]:
        """The stale cells: cells whose lists may be wrong for the current positions of the vertices.
        Returns their words in sections["domain.nodes"], ascending."""
    def reencode_stale(self) -> Reencoded:
        """The asset with new lists in its stale cells, by the encoder and options of the asset:
        Reencoded(asset, cells, checked, stale). The certificate then holds for the current mesh."""
    def inspect(self) -> Inspection:
        """Size and query cost of the asset: counts, list lengths, reads per query, bytes by section,
        and for a conforming domain the classes of its vertices and tetrahedra."""
    def verify(self, samples: int = 10_000) -> VerifyReport:
        """Compares every byte with the checksums, then the answers at `samples` points with brute
        force over all faces; those of an asset that certifies nothing also at up to four points
        inside each of its cells. Ctrl-C ends it with KeyboardInterrupt.

        Raises AssetError if the file is damaged. Wrong answers are in the report."""
    @property
    def certificate(self) -> Certificate:
        """What the encoder proved."""
    @property
    def statistics(self) -> Statistics:
        """Counts from the encoding."""
    @property
    def source(self) -> Source:
        """The file that the mesh came from."""
    @property
    def unit(self) -> str | None:
        """Name of the mesh's unit, or None."""
    @property
    def bounds(self) -> npt.NDArray[np.float64]:
        """Bounding box of the mesh [2, 3]: the lowest and the highest corner."""
    @property
    def vertices(self) -> npt.NDArray[np.float64]:
        """Positions [V, 3] of the vertices in the source's order: a read-only view."""
    @property
    def faces(self) -> npt.NDArray[np.uint32]:
        """Vertices [F, 3] of the faces, uint32, in the order of the file: a read-only view. Row i is
        the face face_ids[i]."""
    @property
    def face_ids(self) -> npt.NDArray[np.uint32]:
        """Id [F] of each row of faces in the source mesh, uint32: a read-only view. Answers use these
        ids."""
    @property
    def sections(self) -> dict[str, npt.NDArray[Any]]:
        """All arrays of the file by name, as read-only views without a copy. Each view keeps the asset
        alive."""
    def __reduce__(self) -> tuple[Callable[[bytes], Asset], tuple[bytes]]: ...
@final
class Robot:
    def __new__(
        cls,
        file: _Path,
        *,
        pose: npt.ArrayLike | None = None,
        packages: dict[str, _Path] | None = None,
        repair: Literal["auto", "never"] = "never",
        ignore: Sequence[str] | None = None,
    ) -> Robot: ...
    def add_obstacle(
        self,
        name: str,
        shape: Body,
        pose: npt.ArrayLike | None = None,
        *,
        scale: float = 1.0,
    ) -> None:
        """Adds an obstacle.

        - name: that no other body has.
        - shape: an Asset, Plane, Box, Sphere or Capsule, or a mesh, which is encoded once.
        - pose: [7] or [4, 4]; None is that of the world.
        - scale: metres for each unit of the shape."""
    def move_obstacle(self, name: str, pose: npt.ArrayLike) -> None:
        """Sets the pose of an obstacle: [7], x y z qx qy qz qw, or [4, 4]."""
    def remove_obstacle(self, name: str) -> None:
        """Removes an obstacle."""
    def set_allowed(self, a: str, b: str, allowed: bool = True) -> None:
        """Sets whether two bodies may collide, by their names: links or a link and an obstacle. Nothing is
        looked at between those that may.

        Raises CollideError for a name that no body has."""
    def clearance(self, q: npt.ArrayLike, *, tolerance: float = 1e-6) -> RobotClearance:
        """The clearance at a configuration q [dof]: RobotClearance, with the pair that is nearest, its
        witness points and the gradient by q.

        tolerance bounds the error, m."""
    def clearances(
        self, q: npt.ArrayLike, *, tolerance: float = 1e-6, threads: int | None = None
    ) -> RobotClearances:
        """The clearances at many configurations q [N, dof], on all threads: RobotClearances. The result
        does not depend on threads; None is one per core."""
    def is_clearance_below(self, q: npt.ArrayLike, bound: float, *, tolerance: float = 1e-6) -> bool:
        """Whether the clearance at a configuration q [dof] is below a bound, m. False is certain. True
        says that it is below bound + tolerance. Takes less time than the clearance."""
    def are_clearances_below(
        self, q: npt.ArrayLike, bound: float, *, tolerance: float = 1e-6, threads: int | None = None
    ) -> npt.NDArray[np.bool_]:
        """As is_clearance_below, at many configurations q [N, dof], on all threads: bool [N]."""
    def in_collision(self, q: npt.ArrayLike, *, tolerance: float = 1e-6) -> bool:
        """Whether bodies collide at a configuration q [dof]: whether the clearance is below 0, up to the
        tolerance, m. False is certain."""
    def are_in_collision(
        self, q: npt.ArrayLike, *, tolerance: float = 1e-6, threads: int | None = None
    ) -> npt.NDArray[np.bool_]:
        """As in_collision, at many configurations q [N, dof], on all threads: bool [N]."""
    def check_motion(
        self,
        q0: npt.ArrayLike,
        q1: npt.ArrayLike,
        *,
        margin: float = 0.0,
        tolerance: float = 1e-4,
        steps: int = 100_000,
    ) -> MotionCheck:
        """Checks the straight line between the configurations q0 [dof] and q1 [dof] as a whole:
        MotionCheck, whose verdict is "free", "collision" or "undecided". The first two are certain:
        nothing between samples is missed. Coordinates are not wrapped.

        - margin: the clearance to keep, m.
        - tolerance: the motion is undecided only where its clearance is above the margin by less than
          twice this, m, or after `steps`.
        - steps: most intervals of pairs of bodies that are looked at."""
    def check_motions(
        self,
        q0: npt.ArrayLike,
        q1: npt.ArrayLike,
        *,
        margin: float = 0.0,
        tolerance: float = 1e-4,
        steps: int = 100_000,
        threads: int | None = None,
    ) -> MotionChecks:
        """Checks the motions from the rows of q0 [N, dof] to those of q1 [N, dof], as check_motion, on all
        threads: MotionChecks."""
    def poses(self, q: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """The poses [L, 7] of the links at a configuration q [dof], x y z qx qy qz qw, in the world. Links
        are the first of `bodies`."""
    @property
    def joints(self) -> list[str]:
        """Names of the joints of a configuration, in its order."""
    @property
    def limits(self) -> npt.NDArray[np.float64]:
        """Limits [dof, 2] of the joints, rad or m; infinite where the file has none."""
    @property
    def bodies(self) -> list[str]:
        """Names of the bodies: the links of the robot in the order of the file, then the obstacles."""
    @property
    def checked_pairs(self) -> list[tuple[str, str]]:
        """The pairs of bodies that are looked at, by their names."""

@final
class Scene:
    def __new__(cls) -> Scene: ...
    def add_shape(self, shape: Body) -> int:
        """Adds a shape: an Asset, which the scene shares, a Plane, Box, Sphere, Capsule or Cylinder.
        Returns its id."""
    def remove_shape(self, shape: int) -> None:
        """Removes a shape that no instance uses."""
    def add(
        self,
        shape: int,
        pose: npt.ArrayLike | None = None,
        *,
        velocity: npt.ArrayLike | None = None,
        scale: float = 1.0,
        world: int = 0,
        memberships: int = 0xFFFFFFFF,
        filter: int = 0xFFFFFFFF,
    ) -> int:
        """Adds an instance of the shape with this id. Returns the id of the instance.

        - pose: [7], x y z qx qy qz qw, or [4, 4]; None is the identity.
        - velocity: [6], vx vy vz wx wy wz; None is rest.
        - scale: world units for each unit of the shape.
        - world: instances of different worlds never meet.
        - memberships, filter: sets of 32 groups, as bits. Two instances meet when the memberships
          of each share a bit with the filter of the other."""
    def add_many(
        self,
        shape: _Integers,
        poses: npt.ArrayLike,
        *,
        velocities: npt.ArrayLike | None = None,
        scale: _Numbers = 1.0,
        world: _Integers = 0,
        memberships: _Integers = 0xFFFFFFFF,
        filter: _Integers = 0xFFFFFFFF,
    ) -> npt.NDArray[np.uint32]:
        """Adds instances in one call, at the poses [N, 7] or [N, 4, 4]. Returns their ids [N], which
        are consecutive.

        shape, scale, world, memberships and filter have one value for all, or one for each, [N].
        velocities has the shape [N, 6]. add explains them. An error names the instance by its row."""
    def update(
        self,
        ids: npt.ArrayLike,
        *,
        poses: npt.ArrayLike | None = None,
        velocities: npt.ArrayLike | None = None,
        scale: _Numbers | None = None,
        world: _Integers | None = None,
        memberships: _Integers | None = None,
        filter: _Integers | None = None,
    ) -> None:
        """Changes the instances with these ids [N]. An argument that is None changes nothing. poses
        have the shape [N, 7] or [N, 4, 4], velocities [N, 6]; the others have one value for all, or
        one for each. An error names the instance by its id, and a pose by its row."""
    def remove(self, ids: npt.ArrayLike) -> None:
        """Removes the instances with these ids [N], and their exclusions."""
    def exclude(self, pairs: npt.ArrayLike) -> None:
        """Excludes pairs of instances [P, 2], so that they never meet."""
    def include(self, pairs: npt.ArrayLike) -> None:
        """Revokes the exclusion of pairs of instances [P, 2]."""
    @property
    def excluded(self) -> npt.NDArray[np.uint32]:
        """The excluded pairs [P, 2], uint32, sorted, with the lower id first."""
    @property
    def shapes(self) -> dict[int, Shape]:
        """The shapes by their ids."""
    @property
    def instances(self) -> Instances:
        """The states of all instances in the order of their ids: Instances(ids, shape, poses,
        velocities, scale, world, memberships, filter), copied."""
    def detect(
        self,
        *,
        mode: Literal["node", "face", "exact"] = "exact",
        contacts_per: Literal["cell", "face", "minimum"] = "face",
        contact_distance: float = 0.0,
        speculative_time: float = 0.0,
        cos_theta: float | None = None,
        iterations: int | None = None,
        tolerance: float | None = None,
        reduce: int | None = None,
        spread: int | None = None,
        precision: _Precision = "f64",
        threads: int | None = None,
        device: _Device = "cpu",
    ) -> Contacts:
        """All contacts up to the contact distance, as Contacts: arrays with a row for each contact.

        Both orders of each pair of instances are tested: features of *a* against the signed
        distance of *b*, and vice versa. The rows are sorted by world, instances, face and cell. The
        bytes do not depend on the number of threads. Ctrl-C ends a detection with
        KeyboardInterrupt.

        - mode: what is tested of a: "node" (its vertices), "face" (faces, by Frank-Wolfe
          iterations, as in the paper) or "exact" (faces, with the exact minimum).
        - contacts_per: in the modes "face" and "exact" only, one contact for each "cell" of b that a
          face meets, as in the paper; or for each "face", with the extremes of flat contact; or of
          these only each local "minimum" over the surface.
        - contact_distance: contacts are reported up to this signed distance.
        - speculative_time: adds to the contact distance what the velocities close within this time.
        - cos_theta: in the modes "face" and "exact" only, drops a contact when the cosine between
          the gradient and the face's normal is above -cos_theta. None keeps all.
        - iterations: number of Frank-Wolfe iterations in the mode "face" only; None is 16.
        - tolerance: largest error in the modes "face" and "exact" only, in the world's unit. None is 1e-7 of the
          diagonal of b.
        - reduce, spread: at most this many contacts for each pair of instances; only one of them.
          reduce finds all contacts and keeps those that matter most for forces and torques. spread
          finds contacts that are spread over the places that touch.
        - precision: "f64" or "f32", of distances, normals and points.
        - threads: number of threads; None is one per core.
        - device: "cpu", "gpu" (what TESDF_DEVICE names, else the best device), or the number of a
          device or a part of its name, such as "cuda:0"; devices lists them. A device computes in
          f32; docs/gpu/design.md says how far its contacts agree with the processor's. It keeps
          the shapes until a detection on another device. Ctrl-C acts after the detection."""
    def detect_on_device(
        self,
        *,
        poses: Any = None,
        velocities: Any = None,
        device: _Device = None,
        mode: Literal["node", "face", "exact"] = "exact",
        contacts_per: Literal["cell", "face", "minimum"] = "face",
        contact_distance: float = 0.0,
        speculative_time: float = 0.0,
        cos_theta: float | None = None,
        iterations: int | None = None,
        tolerance: float | None = None,
        reduce: int | None = None,
        spread: int | None = None,
        precision: _Precision = "f64",
        threads: int | None = None,
    ) -> DeviceContacts:
        """Contacts that stay on a device, as DeviceContacts, for a physics engine on the same device.

        They are those of detect on this device, rounded to float32, sorted by world and instances;
        within a pair, faces have the order of the asset. Normals are gradients of the signed distance,
        and contacts are reduced on the device. On a CUDA device other libraries use the
        arrays in place, and their poses are used in place. Only counters are copied to the processor,
        and contacts only to tell whether they show a deep overlap that was found otherwise. Where the
        processor finds contacts of a body (docs/meshes.md), poses and contacts are copied.

        - poses: float32 [N, 7], x y z qx qy qz qw, a row for each instance in the order of ids: a
          DeviceArray, memory of another library on this device (DLPack or __cuda_array_interface__),
          or an array, which is copied to it. Quaternions have length 1, up to 1e-5. None: the poses
          of the scene, which poses do not change.
        - velocities: float32 [N, 6], vx vy vz wx wy wz, likewise; only with poses. None: at rest.
        - device: as in detect; None is that of poses if these are a DeviceArray, else "gpu".
        - The other options are those of detect, with the same defaults. A device cannot leave all
          contacts per face there: give reduce or spread, contacts_per="cell" or mode="node".
          Without, and with contacts_per="minimum", a DeviceError is raised."""
    def coarse_contacts(
        self,
        *,
        mode: Literal["node", "face", "exact"] = "exact",
        contacts_per: Literal["cell", "face", "minimum"] = "face",
        contact_distance: float = 0.0,
        speculative_time: float = 0.0,
        cos_theta: float | None = None,
        iterations: int | None = None,
        tolerance: float | None = None,
        reduce: int | None = None,
        spread: int | None = None,
        precision: _Precision = "f64",
        threads: int | None = None,
    ) -> CoarseContacts:
        """Faces that touch and that are large against the other body, one for each ordered pair of
        instances: there, the mode "node" can miss where they touch. Returns
        CoarseContacts(instance_a, instance_b, face_a, corner_reach, distance). Options are those of
        detect; mode, contacts_per, cos_theta and the reductions are not used."""
    def touching_features(self, contacts: ContactRows) -> TouchingFeatures:
        """The vertices, edges or faces at the two points of each contact of a detection:
        TouchingFeatures. The scene must have the poses of the detection. Where both orders of two
        instances find the same two features, a and b are swapped in the other order.

        A point is at a vertex or an edge when it is nearer than 2e-6 of the diagonal of the larger
        body, at most 1e-4 of that of the smaller one. Vertices and faces are numbered as in the mesh;
        of a Box, faces are its sides 0 to 5 for -x +x -y +y -z +z, and vertices its nodes; a
        Cylinder has the face 0 on its round side, 1 and 2 at its ends at -z and +z; a Plane, Sphere
        or Capsule has the face 0.

        contacts: Contacts of Scene.detect, or the contacts of a Simulation with a scene of its
        bodies.

        Raises CollideError if the scene lacks an instance or a face of a contact."""
    def clearance(self, a: int, b: int, *, tolerance: float | None = None) -> Clearance:
        """The signed distance between the surfaces of two instances, whatever their worlds, groups and
        exclusions, with witness points: a Clearance.

        tolerance: largest error, in the world's unit. None is 1e-8 of the smaller diagonal."""
    def clearances(self, pairs: npt.ArrayLike, *, tolerance: float | None = None) -> Clearances:
        """The clearances of pairs of instances [P, 2], on all threads: Clearances, arrays with a row
        for each pair. Otherwise as clearance; an error names the row. Ctrl-C ends it with
        KeyboardInterrupt."""
    def times_of_impact(
        self,
        pairs: npt.ArrayLike,
        *,
        velocities_a: npt.ArrayLike | None = None,
        velocities_b: npt.ArrayLike | None = None,
        screws_a: npt.ArrayLike | None = None,
        screws_b: npt.ArrayLike | None = None,
        end: float = 1.0,
        tolerance: float | None = None,
        iterations: int = 1000,
    ) -> Impacts:
        """The first impacts of pairs of moving instances [P, 2], on all threads: Impacts, arrays with
        a row for each pair, whose time is inf where the bodies stay apart until the end, and NaN
        where it is not known.

        velocities_a and velocities_b have the shape [P, 6], screws_a and screws_b [P, 8]; bodies
        without either rest. Otherwise as time_of_impact; an error names the row. Ctrl-C ends it
        with KeyboardInterrupt."""
    def time_of_impact(
        self,
        a: int,
        b: int,
        *,
        velocity_a: npt.ArrayLike | None = None,
        velocity_b: npt.ArrayLike | None = None,
        screw_a: npt.ArrayLike | None = None,
        screw_b: npt.ArrayLike | None = None,
        end: float = 1.0,
        tolerance: float | None = None,
        iterations: int = 1000,
    ) -> Impact | None:
        """The first time at which two moving instances touch: an Impact, or None if they stay apart
        until the end. It is never too late: nothing is sampled. An Impact whose verdict is
        "undecided" has no time; the bodies are apart up to free_until, and what comes then is not
        known.

        - velocity_a, velocity_b: [6], vx vy vz wx wy wz: velocity of the body's origin, and angular
          velocity about it in radians. The velocities of the instances are not used.
        - screw_a, screw_b: [8], px py pz ax ay az omega pitch: a point and the direction of the
          axis, the angular speed in radians, and the travel along the axis for each turn. A body
          without velocity and screw rests.
        - end: the motion is followed from time 0 to this time.
        - tolerance: bodies touch when they are at most this far apart, in the world's unit. None is
          1e-6 of the smaller diagonal.
        - iterations: largest number of steps of a pair of parts of the surfaces. If it is used up,
          the verdict is "undecided"."""
    def why(
        self,
        a: int,
        b: int,
        part: int | None = None,
        *,
        mode: Literal["node", "face", "exact"] = "exact",
        contacts_per: Literal["cell", "face", "minimum"] = "face",
        contact_distance: float = 0.0,
        speculative_time: float = 0.0,
        cos_theta: float | None = None,
        iterations: int | None = None,
        tolerance: float | None = None,
        reduce: int | None = None,
        spread: int | None = None,
        precision: _Precision = "f64",
        threads: int | None = None,
    ) -> WhyReport:
        """Why contacts of two instances exist or not: what each stage of a detection did with the
        faces of a (in the mode "node" its vertices) in the field of b. Returns a WhyReport.

        part: the face or vertex of a (as face_a or feature_a of a contact). None reports all
        candidates. The options are those of detect; the report is that before a reduction."""
    def __len__(self) -> int: ...
    def __copy__(self) -> Scene: ...

@final
class DeviceArray:
    def __new__(cls, array: npt.ArrayLike, device: _Device = "gpu") -> DeviceArray: ...
    def numpy(self) -> npt.NDArray[Any]: ...
    @property
    def device(self) -> str: ...
    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...
    @property
    def __cuda_array_interface__(self) -> dict[str, Any]: ...
    def __dlpack__(
        self,
        *,
        stream: Any = None,
        max_version: tuple[int, int] | None = None,
        dl_device: tuple[int, int] | None = None,
        copy: bool | None = None,
    ) -> Any: ...
    def __dlpack_device__(self) -> tuple[int, int]: ...
    def __len__(self) -> int: ...

@final
class InstancePairs:
    def __new__(cls) -> InstancePairs: ...
    def detect(
        self,
        scene: Scene,
        *,
        moved: npt.ArrayLike | None = None,
        mode: Literal["node", "face", "exact"] = "exact",
        contacts_per: Literal["cell", "face", "minimum"] = "face",
        contact_distance: float = 0.0,
        speculative_time: float = 0.0,
        cos_theta: float | None = None,
        iterations: int | None = None,
        tolerance: float | None = None,
        reduce: int | None = None,
        spread: int | None = None,
        precision: _Precision = "f64",
        threads: int | None = None,
    ) -> Contacts:
        """The contacts of a scene: Contacts. The options are those of Scene.detect.

        moved: ids [N] of the instances that have changed since the last call. Other instances are
        then not looked at, so leaving one out misses its contacts. None looks at all."""
    @property
    def pairs(self) -> npt.NDArray[np.uint32]:
        """The pairs [P, 2] of the last detection, uint32: sorted by world and ids, the lower id first."""

@final
class PatchTracker:
    def __new__(
        cls, *, angle: float = 0.5235987755982988, link: float | None = None, points: int = 4
    ) -> PatchTracker: ...
    def update(self, scene: Scene, contacts: ContactRows) -> ContactPatches:
        """The patches of the contacts of a detection: ContactPatches. The scene must have the poses of
        the detection.

        contacts: Contacts of Scene.detect, or the contacts of a Simulation with a scene of its
        bodies.

        Raises CollideError if the scene lacks an instance of a contact. The tracker is unchanged
        then."""

@final
class Simulation:
    def __new__(
        cls,
        scene: _Path | dict[str, Any],
        *,
        mode: Literal["node", "face", "exact", "off"] | None = None,
        time_step: float | None = None,
        duration: float | None = None,
        threads: int | None = None,
        device: _Device = "cpu",
        history: bool = True,
    ) -> Simulation: ...
    def step(self, count: int = 1) -> None:
        """Makes `count` steps. The duration of the scene does not limit their number. Ctrl-C ends it
        between two steps; the steps so far remain. No thread is started for a call.

        Raises SimulationError if a step fails. The steps before it remain."""
    def run(self, *, progress: Callable[[int, int], object] | None = None) -> dict[str, Any]:
        """Makes the steps that the duration of the scene leaves. Returns the summary.

        progress is called with the number of steps so far and of all steps, about twenty times a
        second. An exception from it ends the run between two steps and is raised."""
    def summary(self) -> dict[str, Any]:
        """Summary of the steps so far, with the names of `tesdf simulate --json`: a dict with
        contacts, energies, momenta and the report of each criterion of the scene. passed says
        whether the criteria hold; None if there are none."""
    def save(self, path: _Path) -> None:
        """Writes the run file of the steps so far, with the bytes of that of the command."""
    def record(self) -> Record:
        """All states so far, recorded contacts, forces and warnings: Record(times, poses, velocities,
        ...), copied."""
    def view(self, *, title: str = "simulation") -> LiveView:
        """Serves a page on this machine that follows the steps from now on, until the simulation is
        deleted: LiveView, whose open() shows it in a browser, and which a notebook shows. title is
        its heading.

        Raises SimulationError where the machine has no loopback interface."""
    def set_motor(
        self,
        joint: str | int,
        *,
        velocity: float | None = None,
        position: float | None = None,
        force: float | None = None,
        spring: Sequence[float] | None = None,
        limit: float = ...,
    ) -> None:
        """Sets the motor of a joint, given by its name or number, from the next step on. It drives one
        of

        - velocity: a rate, rad/s or m/s.
        - position: the coordinate at the end of the step, rad or m.
        - force: a torque, N m, or force, N.
        - spring: (rest, stiffness, damping), in rad, N m/rad, N m s/rad or m, N/m, N s/m. With it,
          velocity is the rate that its damper aims at, and force acts in addition (feed-forward).

        limit is the greatest force, N, or torque, N m. Without a drive the joint has no motor. A
        script of the scene that drives the same joint replaces the motor in each step.

        Raises SimulationError if the joint is no hinge or slider, or if a number is out of range."""
    def set_wrench(self, body: str | int, *, force: Sequence[float] = ..., torque: Sequence[float] = ...) -> None:
        """Sets the force [3], N, on the centre of mass and the torque [3], N m, that act on a body
        from the next step on, in the world frame. The body is given by its name or number. They
        have no effect on fixed and kinematic bodies. A script of the scene for the same body
        replaces them in each step."""
    def set_state(
        self, body: str | int, *, pose: npt.ArrayLike | None = None, velocity: npt.ArrayLike | None = None
    ) -> None:
        """Sets the pose [7], x y z qx qy qz qw, or [4, 4], and the velocity [6], vx vy vz wx wy wz, of
        a body, given by its name or number. What is None stays. For a kinematic body this is its
        motion in the next steps."""
    def set_mass(
        self,
        body: str | int,
        mass: float,
        *,
        center_of_mass: Sequence[float] | None = None,
        inertia: Sequence[float] | None = None,
    ) -> None:
        """Sets the mass of a free body, kg, given by its name or number, from the next step on. The
        body wakes.

        - center_of_mass: [3] in the body's frame, m. None: that in the scene.
        - inertia: [6] xx yy zz xy xz yz about the centre of mass, along the axes of the body's
          frame, kg m². None: that in the scene, in proportion to the mass.

        A reset leaves it as it is; restore brings back that of the snapshot.

        Raises SimulationError if the body is not free, or no body has such a mass."""
    def set_friction(self, body: str | int, coefficient: float) -> None:
        """Sets the coefficient of friction of a body, given by its name or number, from the next step
        on. Between two bodies the geometric mean of theirs acts, unless the scene gives one for the
        pair. The body wakes, with those that it touches. A reset leaves it as it is."""
    def set_friction_torsional(self, body: str | int, coefficient: float) -> None:
        """Sets the coefficient of torsional friction of a body, m, given by its name or number, from the
        next step on: a contact resists spin about its normal by a moment of at most this length times
        its force. Otherwise as set_friction."""
    def set_gravity(self, gravity: Sequence[float]) -> None:
        """Sets gravity [3], m/s², from the next step on. All bodies wake. A reset leaves it as it is."""
    def reset(self, *, poses: npt.ArrayLike | None = None, velocities: npt.ArrayLike | None = None) -> None:
        """Begins again at time 0, with the states of the scene's beginning, or with these poses
        [B, 7], x y z qx qy qz qw, and velocities [B, 6]. Motors are those of the scene, wrenches
        zero, and the history begins anew. Masses, friction and gravity stay as they were set. The
        steps from there on have the same bytes as those of a new simulation.

        Takes some microseconds without a history."""
    def snapshot(self) -> Snapshot:
        """All that the next steps depend on, with the history, to go back to: a Snapshot."""
    def restore(self, snapshot: Snapshot) -> None:
        """Goes back to a snapshot of this simulation or of a copy. The steps from there on have the
        same bytes as those after the snapshot.

        Raises SimulationError if the snapshot is of another simulation."""
    def copy(self) -> Simulation:
        """A simulation that goes on from the same moment on its own. It shares the meshes."""
    def __copy__(self) -> Simulation: ...
    def _repr_html_(self) -> str: ...
    @property
    def masses(self) -> npt.NDArray[np.float64]:
        """Masses [B], kg; inf of bodies that are not free."""
    @property
    def frictions(self) -> npt.NDArray[np.float64]:
        """Coefficients of friction [B] of the bodies."""
    @property
    def frictions_torsional(self) -> npt.NDArray[np.float64]:
        """Coefficients of torsional friction [B] of the bodies, m."""
    @property
    def gravity(self) -> npt.NDArray[np.float64]:
        """Gravity [3], m/s²."""
    @property
    def warnings(self) -> list[str]:
        """What the steps so far did not do as the scene asks, in lines for users: bodies that overlap,
        joints that came apart, energy from nowhere, steps that did not converge. Also without a
        history. summary()["warnings"] has them with names and values."""
    @property
    def bodies(self) -> list[str]:
        """Names of the bodies."""
    @property
    def time(self) -> float:
        """Time since the beginning or the last reset, s: that of the poses and velocities."""
    @property
    def steps(self) -> int:
        """Number of steps since the beginning or the last reset."""
    @property
    def planned_steps(self) -> int:
        """Number of steps of the scene's duration."""
    @property
    def joints(self) -> list[str]:
        """Names of the joints."""
    @property
    def coordinates(self) -> npt.NDArray[np.float64]:
        """Current coordinates [J] of the joints: the angle of a hinge, rad, with the whole turns since
        the start, the travel of a slider, m, the angle by which a ball is bent, rad; 0 for a weld."""
    @property
    def coordinate_rates(self) -> npt.NDArray[np.float64]:
        """Current rates [J] of the coordinates, rad/s or m/s; 0 for a ball and a weld."""
    @property
    def contact_forces(self) -> ContactForces:
        """The forces of the contacts that push, each the mean over the last step: ContactForces."""
    @property
    def joint_forces(self) -> JointForces:
        """What each joint did to its child, as the mean over the last step: JointForces."""
    @property
    def poses(self) -> npt.NDArray[np.float64]:
        """Current poses [B, 7] of the bodies' frames, x y z qx qy qz qw."""
    @property
    def velocities(self) -> npt.NDArray[np.float64]:
        """Current velocities [B, 6], vx vy vz wx wy wz: of the centre of mass, and angular."""
    @property
    def contacts(self) -> StepContacts:
        """The contacts at the beginning of the last step: StepContacts. They include contacts that the
        motion of the step could close. Instances are the bodies."""

@final
class Snapshot:
    def __len__(self) -> int: ...

@final
class Worlds:
    def __new__(
        cls,
        scene: _Path | dict[str, Any],
        count: int,
        *,
        mode: Literal["node", "face", "exact", "off"] | None = None,
        time_step: float | None = None,
        threads: int | None = None,
    ) -> Worlds: ...
    def step(self, count: int = 1) -> None:
        """Makes `count` steps of each world. Ctrl-C ends it between two steps; the steps so far
        remain, the same number in each world. No thread is started for a call.

        Raises SimulationError if a step of a world fails. That world stays as it was before the
        step; the others make theirs."""
    def reset(
        self,
        worlds: npt.ArrayLike | None = None,
        *,
        poses: npt.ArrayLike | None = None,
        velocities: npt.ArrayLike | None = None,
    ) -> None:
        """Begins worlds again at time 0, with the states of the scene's beginning, or with these poses
        [B, 7], x y z qx qy qz qw, and velocities [B, 6], or [k, B, ...] with a row for each of the
        k worlds. Motors are those of the scene, wrenches zero. Masses, friction and gravity stay as
        they were set. The steps from there on have the same bytes as those of new worlds. Takes
        some microseconds for each world."""
    def snapshot(self, worlds: npt.ArrayLike | None = None) -> Snapshot:
        """All that the next steps of worlds depend on, to go back to: a Snapshot."""
    def restore(self, snapshot: Snapshot, worlds: npt.ArrayLike | None = None) -> None:
        """Goes back to a snapshot of as many worlds, in their order, or sets all of them to a snapshot
        of one. It may be of other worlds of this object or of a copy. The steps from there on have
        the same bytes as those after the snapshot."""
    def copy(self) -> Worlds:
        """Worlds that go on from the same moment on their own. They share the meshes."""
    def __copy__(self) -> Worlds: ...
    def set_mass(
        self,
        body: str | int,
        mass: _Numbers,
        *,
        center_of_mass: npt.ArrayLike | None = None,
        inertia: npt.ArrayLike | None = None,
        worlds: npt.ArrayLike | None = None,
    ) -> None:
        """Sets the masses of a free body, kg: a number or [k]; center_of_mass [3] or [k, 3], m, and
        inertia [6] or [k, 6], kg m², as in Simulation.set_mass."""
    def set_friction(self, body: str | int, coefficient: _Numbers, *, worlds: npt.ArrayLike | None = None) -> None:
        """Sets the coefficients of friction of a body: a number or [k], as in Simulation.set_friction."""
    def set_friction_torsional(
        self, body: str | int, coefficient: _Numbers, *, worlds: npt.ArrayLike | None = None
    ) -> None:
        """Sets the coefficients of torsional friction of a body, m: a number or [k], as in
        Simulation.set_friction_torsional."""
    def set_gravity(self, gravity: npt.ArrayLike, *, worlds: npt.ArrayLike | None = None) -> None:
        """Sets gravity: [3] or [k, 3], m/s², as in Simulation.set_gravity."""
    def set_motor(
        self,
        joint: str | int,
        *,
        velocity: _Numbers | None = None,
        position: _Numbers | None = None,
        force: _Numbers | None = None,
        spring: npt.ArrayLike | None = None,
        limit: _Numbers = ...,
        worlds: npt.ArrayLike | None = None,
    ) -> None:
        """Sets the motors of a joint, as in Simulation.set_motor: velocity, position, force and limit
        are numbers or [k], spring is [3] or [k, 3]."""
    def set_wrench(
        self,
        body: str | int,
        *,
        force: npt.ArrayLike | None = None,
        torque: npt.ArrayLike | None = None,
        worlds: npt.ArrayLike | None = None,
    ) -> None:
        """Sets the force, N, and the torque, N m, on a body, each [3] or [k, 3], as in
        Simulation.set_wrench. What is None is zero."""
    def set_state(
        self,
        body: str | int,
        *,
        pose: npt.ArrayLike | None = None,
        velocity: npt.ArrayLike | None = None,
        worlds: npt.ArrayLike | None = None,
    ) -> None:
        """Sets the pose, [7], [4, 4], [k, 7] or [k, 4, 4], and the velocity, [6] or [k, 6], of a body,
        as in Simulation.set_state. What is None stays."""
    def contact_forces(self, world: int) -> ContactForces:
        """The forces of the contacts of a world that push: ContactForces."""
    def warnings(self, world: int) -> list[str]:
        """What the steps of a world since its beginning did not do as its scene asks, in lines for
        users, as in Simulation.warnings. Overlaps are those of now, and are measured for this."""
    def contacts(self, world: int) -> StepContacts:
        """The contacts of a world at the beginning of the last step: StepContacts."""
    @property
    def bodies(self) -> list[str]:
        """Names of the bodies."""
    @property
    def joints(self) -> list[str]:
        """Names of the joints."""
    @property
    def time_step(self) -> float:
        """The time step, s."""
    @property
    def times(self) -> npt.NDArray[np.float64]:
        """Times [n] since the beginning or the last reset, s."""
    @property
    def steps(self) -> npt.NDArray[np.uint64]:
        """Numbers of steps [n] since the beginning or the last reset."""
    @property
    def unconverged_steps(self) -> npt.NDArray[np.uint64]:
        """Numbers of steps [n] since the beginning or the last reset that did not converge: contacts
        or joints contradict each other there, or the time step is too long."""
    @property
    def poses(self) -> npt.NDArray[np.float64]:
        """Current poses [n, B, 7] of the bodies' frames, x y z qx qy qz qw."""
    @property
    def velocities(self) -> npt.NDArray[np.float64]:
        """Current velocities [n, B, 6], vx vy vz wx wy wz: of the centre of mass, and angular."""
    @property
    def coordinates(self) -> npt.NDArray[np.float64]:
        """Current coordinates [n, J] of the joints, as in Simulation."""
    @property
    def coordinate_rates(self) -> npt.NDArray[np.float64]:
        """Current rates [n, J] of the coordinates, rad/s or m/s."""
    @property
    def net_contact_forces(self) -> npt.NDArray[np.float64]:
        """The force [n, B, 3] of all contacts on each body, in the world's frame, N: the mean over the
        last step."""
    @property
    def joint_forces(self) -> JointForces:
        """What each joint did to its child, as the mean over the last step: JointForces with arrays
        [n, J, ...]."""
    @property
    def masses(self) -> npt.NDArray[np.float64]:
        """Masses [n, B], kg; inf of bodies that are not free."""
    @property
    def frictions(self) -> npt.NDArray[np.float64]:
        """Coefficients of friction [n, B] of the bodies."""
    @property
    def frictions_torsional(self) -> npt.NDArray[np.float64]:
        """Coefficients of torsional friction [n, B] of the bodies, m."""
    @property
    def gravity(self) -> npt.NDArray[np.float64]:
        """Gravity [n, 3], m/s²."""
    def __len__(self) -> int: ...

def export(
    run: _Path | Simulation | Record,
    path: _Path,
    *,
    every: int | None = None,
    fps: float | None = None,
    speed: float = 1.0,
    geometries: Mapping[str, _Path] | None = None,
) -> None:
    """Writes a run as an animated GLB file, which Blender, three.js and others play.

    - run: the path of a run of `tesdf simulate` or Simulation.save, a Simulation, whose steps so far
      are taken, or a Record.
    - path: the file.
    - every: every N-th step and the last one are played. fps: the steps nearest to this many times
      in each second of the run. Without both, at most 1000 steps are.
    - speed: seconds of the run in each second of the animation.
    - geometries: files in place of the meshes that the run names: a dict of names of bodies and
      paths. Not for a Simulation or Record, which has its meshes.

    Each body is a node with its name; lengths are metres, and y is up, as glTF wants it. The same
    run gives the bytes of `tesdf export`.

    Raises OSError if a file cannot be read or written, SceneError if a mesh is missing, and
    SimulationError if the run cannot be played."""
def view(
    run: _Path | Simulation | Record,
    path: _Path,
    *,
    every: int | None = None,
    fps: float | None = None,
    contacts: int | None = None,
    title: str | None = None,
    geometries: Mapping[str, _Path] | None = None,
    progress: Callable[[str, float], object] | None = None,
    in_notebook: bool = False,
) -> None:
    """Writes the page of tesdf.view to a file, with its arguments.

    - contacts: None are those that the run has recorded, where it has those of all frames but the
      last, else none.
    - in_notebook: without every and fps, at most 300 steps are played, if possible at those whose
      contacts are recorded."""
def pair(a: Body, b: Body, pose_a: npt.ArrayLike | None, pose_b: npt.ArrayLike | None) -> Scene:
    """A scene of two bodies, as the instances 0 and 1.

    Raises ValueError if they are assets in different units."""
