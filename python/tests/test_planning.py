"""Robots for planners: clearances against formulas, derivatives against differences, motions against samples."""

from pathlib import Path

import numpy as np
import pytest
import tesdf

ARM = Path(__file__).parents[2] / "data/robots/six-axis-arm.urdf"
TURN = np.array([0.0, 0.0, -0.4, -0.9, 0.0, 0.0])


@pytest.fixture(scope="module")
def arm():
    """The arm with a wall of a window before it."""
    robot = tesdf.Robot(ARM)
    for name, y in [("left", 0.35), ("right", -0.35)]:
        robot.add_obstacle(name, tesdf.Box((0.02, 0.2, 0.5)), [0.45, y, 0.5, 0, 0, 0, 1])
    robot.add_obstacle("floor", tesdf.Plane(), [0, 0, -0.01, 0, 0, 0, 1])
    return robot


def rows(robot, count, seed=1):
    low, high = robot.limits.clip(-np.pi, np.pi).T
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def test_what_a_robot_says_of_itself(arm):
    assert arm.joints == ["pan", "lift", "elbow", "roll", "bend", "turn"]
    assert arm.bodies[:2] == ["base", "shoulder"] and arm.bodies[-3:] == ["left", "right", "floor"]
    assert arm.limits.shape == (6, 2) and arm.limits[1].tolist() == [-2, 2]
    assert ("base", "shoulder") not in arm.checked_pairs and ("tool", "left") in arm.checked_pairs
    assert repr(arm) == "<tesdf.Robot: 6 joints, 7 links, 3 obstacles>"
    # Stretched out, all joints are above each other: 0.14 + 0.08 + 0.4 + 0.25 + 0.14 + 0.075 m.
    assert arm.poses(np.zeros(6))[6] == pytest.approx([0, 0.03, 1.085, 0, 0, 0, 1], abs=1e-12)


def test_the_clearance_of_an_arm_stretched_out_is_that_of_its_plan(arm):
    robot = tesdf.Robot(ARM)
    robot.add_obstacle("ceiling", tesdf.Plane(), [0, 0, 1.195, 1, 0, 0, 0])
    found = robot.clearance(np.zeros(6))
    # The fingers reach 0.09 m beyond the flange.
    assert (found.body_a, found.body_b) == ("tool", "ceiling")
    assert found.distance == pytest.approx(0.02, abs=1e-6) and found.converged
    assert found.normal == pytest.approx([0, 0, -1], abs=1e-9)
    assert found.point_b[2] == pytest.approx(1.195, abs=1e-9) and found.lower_bound <= found.distance


def test_gradients_are_those_of_differences(arm):
    smooth = 0
    for q in rows(arm, 12):
        found = arm.clearance(q, tolerance=1e-9)
        if found.distance < 0:
            continue
        steps = 1e-3 * np.eye(6)
        at = lambda k: arm.clearances(q + k * steps, tolerance=1e-12).distance  # noqa: E731
        fine = (8 * (at(1) - at(-1)) - at(2) + at(-2)) / 12e-3
        coarse = (8 * (at(2) - at(-2)) - at(4) + at(-4)) / 24e-3
        kink = np.abs(coarse - fine) > 1e-8
        smooth += (~kink).sum()
        # At round links, the direction is known up to the root of twice the tolerance over their radius.
        assert found.gradient[~kink] == pytest.approx(fine[~kink], rel=2e-4, abs=2e-5)
    assert smooth > 20


def test_rows_are_those_of_single_calls_on_any_number_of_threads(arm):
    q = rows(arm, 60)
    one, two = arm.clearances(q, threads=1), arm.clearances(q, threads=2)
    for name, array in one.arrays().items():
        assert array.tobytes() == getattr(two, name).tobytes(), name
    single = [arm.clearance(row) for row in q]
    assert one.distance.tolist() == [found.distance for found in single]
    assert [arm.bodies[k] for k in one.body_b] == [found.body_b for found in single]
    assert one.gradient.shape == (60, 6) and one[3].distance == single[3].distance
    collide = arm.are_in_collision(q)
    assert collide.dtype == bool and 0 < collide.sum() < 60
    assert collide.tolist() == (one.distance < 0).tolist() == [arm.in_collision(row) for row in q]
    below = arm.are_clearances_below(q, 0.03, threads=2)
    assert below.tolist() == (one.distance < 0.03).tolist()
    assert arm.is_clearance_below(q[0], 0.03) == below[0]
    checks = [arm.check_motions(q[:-1], q[1:], tolerance=1e-3, threads=n) for n in (1, 2)]
    for name, array in checks[0].arrays().items():
        assert array.tobytes() == getattr(checks[1], name).tobytes(), name
    assert checks[0].free.any() and checks[0].collides.any()
    for k in range(5):
        check = arm.check_motion(q[k], q[k + 1], tolerance=1e-3)
        assert bool(check) == checks[0].free[k] and check.steps == checks[0].steps[k]


def test_motions_are_never_free_where_samples_collide(arm):
    q = rows(arm, 41, seed=4)
    q = q[~arm.are_in_collision(q)]
    ends = q[1:]
    starts, verdicts = q[:-1], set()
    for k, (q0, q1) in enumerate(zip(starts, ends)):
        q1 = q0 + [0.1, 1.0][k % 2] * (q1 - q0)
        check = arm.check_motion(q0, q1)
        verdicts.add(check.verdict)
        samples = q0 + np.linspace(0, 1, 80)[:, None] * (q1 - q0)
        least = arm.clearances(samples).distance.min()
        if check:
            assert least > 0 and check.parameter is None
        elif check.verdict == "collision":
            there = arm.clearance(q0 + check.parameter * (q1 - q0))
            assert there.distance < 1e-9 and check.distance >= there.distance - 1e-6
            assert check.body_a in arm.bodies and check.body_b in arm.bodies
    assert {"free", "collision"} <= verdicts


def test_a_wall_between_two_samples_is_found():
    robot = tesdf.Robot(ARM)
    robot.add_obstacle("sheet", tesdf.Box((0.3, 1e-5, 0.5)), [0.6, 0, 0.6, 0, 0, 0, 1])
    q0, q1 = TURN + [1, 1.4, 0, 0, 0, 0], TURN + [-1, 1.4, 0, 0, 0, 0]
    assert not robot.in_collision(q0) and not robot.in_collision(q1)
    check = robot.check_motion(q0, q1)
    assert check.verdict == "collision" and check.body_b == "sheet" and 0.2 < check.parameter < 0.8
    assert robot.check_motion(q0, q1, steps=1).verdict == "undecided"
    # Beside it a margin decides.
    robot.move_obstacle("sheet", [0.6, 2, 0.6, 0, 0, 0, 1])
    clearance = robot.clearance(q0).distance
    assert robot.check_motion(q0, q0 + 1e-6, margin=clearance - 1e-3)
    assert not robot.check_motion(q0, q0 + 1e-6, margin=clearance + 1e-3)


def test_pairs_are_allowed_by_their_names(arm):
    robot = tesdf.Robot(ARM)
    robot.add_obstacle("table", tesdf.Plane(), [0, 0, 0.3, 0, 0, 0, 1])
    assert robot.in_collision(np.zeros(6))
    for link in ["shoulder", "upper"]:
        robot.set_allowed(link, "table")
    assert not robot.in_collision(np.zeros(6))
    robot.set_allowed("table", "upper", False)
    assert robot.clearance(np.zeros(6)).body_a == "upper"
    robot.remove_obstacle("table")
    assert "table" not in robot.bodies
    with pytest.raises(tesdf.CollideError, match="no body tabel; expected one of base, shoulder"):
        robot.set_allowed("tool", "tabel")


def test_what_is_wrong_is_named(arm, tmp_path):
    with pytest.raises(tesdf.CollideError, match="5 numbers; expected 6 finite numbers, of the joints pan, lift"):
        arm.clearance(np.zeros(5))
    with pytest.raises(ValueError, match=r"q: an array of shape \(6,\); expected shape \(N, 6\)"):
        arm.clearances(np.zeros(6))
    with pytest.raises(tesdf.CollideError, match="row 700: a configuration has the number NaN"):
        arm.clearances(np.where(np.arange(800)[:, None] == 700, np.nan, np.zeros((800, 6))))
    with pytest.raises(ValueError, match="q1: 2 rows; expected 3, as q0"):
        arm.check_motions(np.zeros((3, 6)), np.zeros((2, 6)))
    with pytest.raises(tesdf.CollideError, match="tolerance: 0; expected a finite length above 0"):
        arm.check_motion(np.zeros(6), np.zeros(6), tolerance=0)
    with pytest.raises(ValueError, match="repair: 'yes'"):
        tesdf.Robot(ARM, repair="yes")
    with pytest.raises(tesdf.SceneError, match="missing.urdf"):
        tesdf.Robot(tmp_path / "missing.urdf")
