"""Devices of a package without the feature `gpu`: errors that say how to build it."""

import numpy as np
import pytest
import tesdf

HOW = 'built without the GPU; build it in the repository with `pip install ./python -C build-args="--features gpu"`'


def test_a_device_is_an_error_that_says_how_to_build(asset, points):
    assert tesdf.devices() == []
    ball = tesdf.Sphere(1)
    scene = {"time_step": 1e-3, "duration": 1e-3, "bodies": [{"name": "ball", "shape": {"sphere": {"radius": 1}}, "mass": 1}]}
    for call in (
        lambda: tesdf.DeviceArray(np.zeros(3)),
        lambda: tesdf.collide(ball, ball, device="gpu"),
        lambda: asset.query(points, device="cuda:0"),
        lambda: tesdf.Simulation(scene, device=1),
        lambda: tesdf.Scene().detect_on_device(),
    ):
        with pytest.raises(tesdf.DeviceError) as refused:
            call()
        assert HOW in str(refused.value)


def test_the_processor_needs_no_device(asset, points):
    for device in (None, "cpu"):
        assert np.array_equal(asset.query(points, device=device).signed_distance, asset.signed_distance(points))
        assert len(tesdf.collide(tesdf.Sphere(1), tesdf.Sphere(1), pose_b=[1.5, 0, 0, 0, 0, 0, 1], device=device)) > 0
