"""Derivatives against central differences, under JAX's transformations."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import tesdf
import tesdf.jax
from conftest import PARTS

jax.config.update("jax_enable_x64", True)


@pytest.fixture(scope="module")
def asset():
    return tesdf.encode(PARTS / "l_bracket.obj", "fast")


def points(asset, count):
    low, high = asset.bounds
    return low + (high - low) * np.random.default_rng(5).uniform(-0.2, 1.2, (count, 3))


def test_distances_are_those_of_tesdf_under_each_transformation(asset):
    at = points(asset, 60)
    expected = tesdf.signed_distance(asset, at)
    found = {
        "plain": tesdf.jax.signed_distance(asset, at),
        "jit": jax.jit(lambda x: tesdf.jax.signed_distance(asset, x))(at),
        "vmap": jax.vmap(lambda x: tesdf.jax.signed_distance(asset, x))(at),
        "axes": tesdf.jax.signed_distance(asset, at.reshape(3, 4, 5, 3)).reshape(-1),
    }
    for name, distances in found.items():
        np.testing.assert_array_equal(distances, expected, err_msg=name)
    single = tesdf.jax.signed_distance(asset, at.astype(np.float32))
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, expected, atol=1e-6)
    assert tesdf.jax.signed_distance(asset, at[0]).shape == ()
    assert tesdf.jax.signed_distance(asset, np.zeros((0, 3))).shape == (0,)


def test_derivatives_by_points_and_poses_are_those_of_differences(asset):
    at = points(asset, 300)

    def of_pose(pose, scale):
        """distances where the mesh is turned about z, moved and scaled"""
        c, s = jnp.cos(pose[3]), jnp.sin(pose[3])
        local = (at - pose[:3]) @ jnp.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) / scale
        return scale * tesdf.jax.signed_distance(asset, local)

    pose, scale, step = np.array([0.01, -0.02, 0.005, 0.3]), 1.1, 1e-6
    by_pose = jax.jit(jax.jacrev(of_pose))(pose, scale)
    for k in range(4):
        move = step * np.eye(4)[k]
        fine = (of_pose(pose + move, scale) - of_pose(pose - move, scale)) / (2 * step)
        wrong = np.abs(fine - by_pose[:, k]) > 1e-6
        # Elsewhere a kink is within the step.
        assert wrong.mean() < 0.02, (k, np.abs(fine - by_pose[:, k])[wrong])
    push = jax.grad(lambda x: tesdf.jax.signed_distance(asset, x).sum())(at)
    np.testing.assert_allclose(np.linalg.norm(push, axis=1), 1.0, rtol=1e-12)
    each = jax.vmap(jax.grad(lambda x: tesdf.jax.signed_distance(asset, x)))(at)
    np.testing.assert_array_equal(each, push)


def test_second_and_forward_derivatives_and_other_shapes_are_errors(asset):
    def distance(x):
        return tesdf.jax.signed_distance(asset, x)

    at = points(asset, 1)[0]
    with pytest.raises(Exception, match="custom_vjp|callback|JVP"):
        jax.hessian(distance)(at)
    with pytest.raises(Exception, match="custom_vjp"):
        jax.jvp(distance, (at,), (at,))
    with pytest.raises(TypeError, match="an array of int64; expected floating-point numbers"):
        distance(np.zeros(3, int))
    with pytest.raises(ValueError, match=r"shape \(2,\); expected shape \(\.\.\., 3\)"):
        distance(at[:2])
