"""Exact signed distances and contacts of triangle meshes, in numpy.

    tesdf.signed_distance("part.stl", points)           # also contains, closest_point; the mesh is encoded once
    tesdf.clearance("a.stl", "b.stl", pose_a, pose_b)   # exact, with witness points

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

    scene = tesdf.Scene()                               # instances share their asset
    part, floor = scene.add_shape(asset), scene.add_shape(tesdf.Plane())
    scene.add(floor)
    ids = scene.add_many(part, poses)                   # poses [N, 7], x y z qx qy qz qw, or [N, 4, 4]
    contacts = scene.detect(contact_distance=1e-4)      # contacts.point_a, contacts.distance, ...
    scene.update(ids, poses=poses)                      # and so on

    tesdf.collide(asset, tesdf.Sphere(1.0), pose_b=pose)             # contacts of two bodies
    tesdf.time_of_impact(asset, asset, pose_b=pose, velocity_b=velocity)

    import tesdf.torch                                  # distances and clearances with derivatives
    scene.clearances(pairs).distance                    # of many pairs [P, 2]; times_of_impact
    manager = tesdf.CollisionManager()                  # named bodies, with the methods of trimesh's
    kept = tesdf.InstancePairs()                        # kept.detect(scene): less work where most bodies rest
    tracker = tesdf.PatchTracker()                      # tracker.update(scene, contacts): regions with lasting ids

    robot = tesdf.Robot("arm.urdf")                     # for planners, in metres
    robot.add_obstacle("part", "part.stl", pose)        # set_allowed("tool", "part")
    robot.clearance(q).gradient, robot.in_collision(q)  # clearances and are_in_collision for q [N, dof]
    robot.check_motion(q0, q1).verdict                  # of the whole line, certainly: "free", "collision"

    tesdf.devices()                                     # GPUs, if the package was built with them
    scene.detect(device="gpu")                          # and asset.query(points, device="gpu"), Simulation

    simulation = tesdf.Simulation("scene.toml")         # bodies in motion, as `tesdf simulate`
    simulation.set_motor("slide", velocity=0.1)         # set_wrench, set_state
    simulation.step()                                   # simulation.poses, simulation.contacts, ...
    simulation.run()["passed"]                          # to the end; the summary, with the criteria
    moment = simulation.snapshot()                      # restore(moment), reset, copy; set_mass, set_friction, ...
    worlds = tesdf.Worlds("scene.toml", 256)            # arrays [256, ...]; worlds.step(), worlds.reset(done)
    tesdf.view(simulation)                              # plays it in a browser; tesdf.export for GLB and rerun

All lengths are in the mesh's unit, and all ids start from 0. Errors are `MeshError`
(`NotSolidError` if the mesh has no well-defined inside), `EncodeError`, `DeformError`,
`AssetError`, `CollideError`, `DeviceError`, `SceneError` and `SimulationError`, which are all `ValueError`s, and `OSError` for files.
"""

from ._native import (
    NO_CELL,
    NO_FACE,
    Asset,
    DeviceArray,
    InstancePairs,
    PatchTracker,
    Robot,
    Scene,
    Simulation,
    Snapshot,
    Worlds,
    __version__,
    check,
    devices,
    encode,
    import_json,
    repair,
)
from .bodies import clearance, collide, time_of_impact, why
from .contacts import (
    Clearances,
    CoarseContacts,
    ContactForces,
    ContactPatches,
    Contacts,
    DeviceContacts,
    HiddenOverlaps,
    Impacts,
    Instances,
    JointForces,
    Record,
    Reductions,
    StepContacts,
    TouchingFeatures,
)
from .errors import (
    AssetError,
    CollideError,
    DeformError,
    DeviceError,
    EncodeError,
    MeshError,
    NotSolidError,
    SceneError,
    SimulationError,
)
from .managers import CollisionManager, ContactData, DistanceData
from .planning import MotionCheck, MotionChecks, RobotClearance, RobotClearances
from .playback import LiveView, Page, export, view
from .queries import closest_point, contains, signed_distance
from .reports import (
    CheckReport,
    Clearance,
    Defect,
    DetectionStatistics,
    Device,
    Impact,
    RepairReport,
    VerifyReport,
    WhyReport,
)
from .results import Answers, ClosestPoints, DeviceAnswers, Moved, RayHits, Reencoded, Repaired
from .shapes import Box, Capsule, Cylinder, Plane, Sphere
from .usd import UsdMesh, read_usd

__all__ = [
    "NO_CELL",
    "NO_FACE",
    "Answers",
    "Asset",
    "AssetError",
    "Box",
    "Capsule",
    "Cylinder",
    "CheckReport",
    "Clearance",
    "Clearances",
    "ClosestPoints",
    "CoarseContacts",
    "CollideError",
    "CollisionManager",
    "ContactData",
    "ContactForces",
    "ContactPatches",
    "Contacts",
    "Defect",
    "DeformError",
    "DetectionStatistics",
    "Device",
    "DeviceAnswers",
    "DeviceArray",
    "DeviceContacts",
    "DeviceError",
    "DistanceData",
    "EncodeError",
    "HiddenOverlaps",
    "Impact",
    "Impacts",
    "InstancePairs",
    "Instances",
    "JointForces",
    "LiveView",
    "MeshError",
    "MotionCheck",
    "MotionChecks",
    "Moved",
    "NotSolidError",
    "Page",
    "PatchTracker",
    "Plane",
    "RayHits",
    "Record",
    "Reductions",
    "Reencoded",
    "RepairReport",
    "Repaired",
    "Robot",
    "RobotClearance",
    "RobotClearances",
    "Scene",
    "SceneError",
    "Simulation",
    "SimulationError",
    "Snapshot",
    "Sphere",
    "StepContacts",
    "TouchingFeatures",
    "UsdMesh",
    "VerifyReport",
    "WhyReport",
    "Worlds",
    "__version__",
    "check",
    "clearance",
    "closest_point",
    "collide",
    "contains",
    "devices",
    "encode",
    "export",
    "import_json",
    "read_usd",
    "repair",
    "signed_distance",
    "time_of_impact",
    "view",
    "why",
]
