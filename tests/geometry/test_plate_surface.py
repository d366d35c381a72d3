"""Common causes of residuals, against refitted poses and plain least squares."""

from dataclasses import replace

import numpy as np
import pytest
from bent_plates import POINTS, bent, photographed
from pictures import WIDE

from handeye_cli.geometry import plate_surface, pnp, se3
from handeye_cli.geometry.plate_surface import BOW, CommonCauses, PosedViews
from handeye_cli.views import views_of

SIZE = (WIDE.width, WIDE.height)
NOTHING = np.zeros((WIDE.parameters.size, 0))


def posed(plate=POINTS, *, sigma_px=0.1, count=7) -> PosedViews:
    shot = photographed(np.random.default_rng(5), plate, count=count, sigma_px=sigma_px)
    seen = views_of(shot.features.stations, POINTS).seen
    mask = seen.mask.copy()
    mask[1, :9] = False
    seen = replace(seen, mask=mask)
    poses, _ = pnp.refine(shot.camera_T_target, seen, WIDE.lens)
    return PosedViews(poses, seen, np.linspace(0.5, 1.5, count), WIDE.lens)


def causes(directions=NOTHING, prior=None, image_size=SIZE) -> CommonCauses:
    size = directions.shape[1]
    prior = np.zeros((size, size)) if prior is None else prior
    fields = plate_surface.plate_fields(POINTS)
    return CommonCauses(directions, prior, fields, image_size, np.zeros(size))


def columns_by_hand(views: PosedViews, which: CommonCauses):
    """All columns and the residuals with explicit columns for the poses: (rows, c), (rows,)."""
    bare = replace(views, seen=replace(views.seen, points=views.seen.points))
    blocks, rest = [], []
    for i in range(len(views.poses)):
        one = bare.part(slice(i, i + 1))
        r, J, K = pnp.residuals(one.poses, one.seen, one.lens)
        by_point = J[0, :, :, :3] @ one.poses[0, :3, :3]
        u, v = np.moveaxis((one.seen.pixels[0] + r[0] - (np.array(SIZE) - 1) / 2), -1, 0)
        u, v = 2 * u / (SIZE[0] - 1), 2 * v / (SIZE[0] - 1)
        terms = [u**i * v**j for i in range(4) for j in range(4) if i + j < 4]
        image = [np.stack([t, 0 * t], axis=-1) for t in terms]
        image += [np.stack([0 * t, t], axis=-1) for t in terms]
        own = np.concatenate([K[0] @ which.directions, by_point @ which.fields], axis=-1)
        full = np.concatenate([own, np.stack(image, axis=-1)], axis=-1)
        keep = one.seen.mask[0]
        pose = np.zeros((keep.sum() * 2, 6 * len(views.poses)))
        pose[:, 6 * i : 6 * i + 6] = J[0][keep].reshape(-1, 6) / one.sigma
        blocks.append(np.hstack([full[keep].reshape(pose.shape[0], -1) / one.sigma, pose]))
        rest.append(r[0][keep].ravel() / one.sigma)
    return np.vstack(blocks), np.concatenate(rest)


def test_fits_are_those_of_plain_least_squares():
    views = posed(bent(1e-3))
    which = causes(1e-2 * np.eye(WIDE.parameters.size)[:, 4:6])
    equations = plate_surface.common_equations(views, which)
    full, r = columns_by_hand(views, which)
    poses = np.arange(len(equations.before), full.shape[1])
    for chosen in (which.plate, which.lens, np.concatenate([which.lens, which.plate])):
        fit = equations.fitted(chosen)
        A = full[:, np.concatenate([chosen, poses])]
        x, squares, *_ = np.linalg.lstsq(A / np.linalg.norm(A, axis=0), -r, rcond=1e-12)
        x = x / np.linalg.norm(A, axis=0)
        np.testing.assert_allclose(fit.values, x[: len(chosen)], rtol=1e-5)
        assert fit.squares == pytest.approx(float(squares[0]), rel=1e-8)
        assert fit.rank == len(chosen)
    assert equations.freedom == len(r) - len(poses)


def test_what_one_surface_explains_beyond_another():
    views = posed(bent(1e-3))
    which = causes()
    equations = plate_surface.common_equations(views, which)
    beyond = equations.beyond(which.image, which.plate)
    both = equations.fitted(np.concatenate([which.plate, which.image]))
    assert beyond.squares_before == pytest.approx(equations.fitted(which.image).squares, rel=1e-9)
    assert beyond.squares == pytest.approx(both.squares, rel=1e-6)


def test_poses_move_with_the_plate_as_if_fitted_again():
    views = posed(sigma_px=0.0)
    which = causes(image_size=None)
    equations = plate_surface.common_equations(views, which)
    for k in range(which.fields.shape[2]):
        moved = []
        for sign in (1, -1):
            points = POINTS + sign * 1e-6 * which.fields[..., k]
            seen = replace(views.seen, points=points)
            moved.append(pnp.refine(views.poses, seen, views.lens)[0])
        by_hand = se3.difference(*moved) / 2e-6
        np.testing.assert_allclose(equations.by_common[..., k], by_hand, atol=2e-4, rtol=1e-3)


def test_a_bow_is_measured_without_noise():
    views = posed(bent(1e-3), sigma_px=0.0, count=12)
    which = causes(image_size=None)
    fit = plate_surface.common_equations(views, which).fitted(which.plate)
    height = which.fields[:, 2, :BOW] @ fit.values[:BOW]
    # To first order: what is left is of the order of the slope of the bow.
    assert np.ptp(height) == pytest.approx(1e-3, rel=0.03)
    assert np.all(np.abs(fit.values[BOW:]) < 2e-4)


def test_chunks_make_no_difference(monkeypatch):
    views, which = posed(), causes()
    whole = plate_surface.common_equations(views, which)
    fit = whole.fitted(which.plate)
    spread = plate_surface.clustered_covariances(views, which, fit, which.plate)
    monkeypatch.setattr(plate_surface, "_CHUNK", 3)
    parts = plate_surface.common_equations(views, which)
    np.testing.assert_allclose(parts.products, whole.products, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(parts.by_common, whole.by_common)
    again = plate_surface.clustered_covariances(views, which, fit, which.plate)
    np.testing.assert_allclose(np.array(again), np.array(spread), rtol=1e-9)


def test_a_prior_holds_the_lens():
    views = posed(bent(1e-3))
    directions = 1e-2 * np.eye(WIDE.parameters.size)[:, 4:6]
    free = causes(directions)
    held = causes(directions, 1e12 * np.eye(2))
    values = [
        plate_surface.common_equations(views, each).fitted(each.lens).values
        for each in (free, held)
    ]
    assert np.all(np.abs(values[0]) > 1e-3)
    assert np.all(np.abs(values[1]) < 1e-6)


def test_four_corners_show_a_twist_alone():
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * 0.05
    fields = plate_surface.plate_fields(corners)
    assert not fields[:, 2, [0, 2]].any()
    np.testing.assert_allclose(np.abs(fields[:, 2, 1]), 1.0)


def test_the_bow_has_no_plane():
    fields = plate_surface.plate_fields(POINTS)
    plane = np.column_stack([np.ones(len(POINTS)), POINTS[:, :2]])
    np.testing.assert_allclose(plane.T @ fields[:, 2, :BOW], 0.0, atol=1e-12)


def test_clusters_see_errors_of_the_print():
    """Points misplaced alike in all views: independent pixels would call them certain."""
    rng = np.random.default_rng(8)
    which = causes(image_size=None)
    values, by_pixels, by_points = [], [], []
    for _ in range(30):
        plate = POINTS + np.pad(1e-4 * rng.normal(size=(len(POINTS), 2)), ((0, 0), (0, 1)))
        views = posed(plate, sigma_px=0.02)
        equations = plate_surface.common_equations(views, which)
        fit = equations.fitted(which.plate)
        variance = fit.squares / (equations.freedom - fit.rank)
        points, _ = plate_surface.clustered_covariances(views, which, fit, which.plate)
        values.append(fit.values)
        by_pixels.append(variance * np.diag(fit.covariance))
        by_points.append(np.diag(points))
    strain = np.mean(np.square(values), axis=0)[BOW:]
    assert np.all(strain > 2.0 * np.mean(by_pixels, axis=0)[BOW:])
    # Sixty squares, and clusters that are a little too few for what was fitted.
    assert 0.5 < np.mean(strain / np.mean(by_points, axis=0)[BOW:]) < 2.0
