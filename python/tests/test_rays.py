"""Rays through closed solids, and heights from normals."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import glasswarp as gw

Array = npt.NDArray[np.float64]


def ball(rings: int) -> tuple[Array, npt.NDArray[np.uint32]]:
    """A ball of radius 1, by latitude and longitude."""
    around = 2 * rings
    theta, phi = np.meshgrid(np.pi * np.arange(1, rings) / rings, 2 * np.pi * np.arange(around) / around, indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), -np.cos(theta)], axis=-1).reshape(-1, 3)
    south, north = len(points), len(points) + 1
    faces: list[tuple[int, int, int]] = []
    for k in range(around):
        n = (k + 1) % around
        faces += [(south, n, k), (north, (rings - 2) * around + k, (rings - 2) * around + n)]
        for ring in range(rings - 2):
            a, b, c, d = ((ring + up) * around + at for up, at in ((0, k), (0, n), (1, n), (1, k)))
            faces += [(a, b, c), (a, c, d)]
    return np.vstack([points, [[0, 0, -1], [0, 0, 1]]]), np.array(faces, dtype=np.uint32)


def along_z(x: Array) -> Array:
    rays = np.zeros((len(x), 6))
    rays[:, 0], rays[:, 2], rays[:, 5] = x, -3.0, 1.0
    return rays


def test_a_ball_turns_light_as_snellius_says() -> None:
    vertices, faces = ball(400)
    offsets = np.linspace(0.05, 0.9, 30)
    found = gw.trace(vertices, faces, along_z(offsets), ior=1.5)
    assert (found.how == gw.LEFT).all() and (found.interfaces == 2).all() and (found.transmittance == 1.0).all()
    turned = 2 * (np.arcsin(offsets) - np.arcsin(offsets / 1.5))
    # Facets are up to half a ring off the ball's slope, at either side.
    assert np.abs(np.arctan2(-found.directions[:, 0], found.directions[:, 2]) - turned).max() < 2 * np.pi / 400
    assert np.allclose(np.linalg.norm(found.directions, axis=1), 1.0, atol=1e-12)
    assert np.allclose(np.linalg.norm(found.points, axis=1), 1.0, atol=1e-3)


def test_light_from_any_side_goes_back_the_way_it_came() -> None:
    vertices, faces = ball(20)
    rng = np.random.default_rng(7)
    origins = rng.normal(size=(500, 3))
    origins *= 5 / np.linalg.norm(origins, axis=1)[:, None]
    rays = np.hstack([origins, rng.uniform(-0.5, 0.5, (500, 3)) - origins])
    there = gw.trace(vertices, faces, rays, material="pmma")
    left = there.how == gw.LEFT
    assert left.sum() > 400
    back = gw.trace(
        vertices, faces, np.hstack([there.points + 2 * there.directions, -there.directions])[left], material="pmma"
    )
    directions = rays[left, 3:] / np.linalg.norm(rays[left, 3:], axis=1)[:, None]
    assert np.allclose(back.directions, -directions, atol=1e-9)


def test_fresnels_equations_and_rays_that_miss() -> None:
    vertices, faces = ball(60)
    found = gw.trace(vertices, faces, along_z(np.array([1e-3, 1.5])), ior=1.5, fresnel=True)
    assert list(found.how) == [gw.LEFT, gw.MISSED]
    assert found.transmittance[0] == pytest.approx(0.96**2, abs=2e-3) and found.transmittance[1] == 1.0
    assert list(found.points[1]) == [1.5, 0.0, -3.0]


def test_the_block_of_a_design_draws_its_picture(block: gw.Block) -> None:
    vertices, faces = block.mesh()
    y, x = np.mgrid[-22:22:301j, -29.5:29.5:401j]
    rays = np.zeros((x.size, 6))
    rays[:, 0], rays[:, 1], rays[:, 2], rays[:, 5] = x.ravel(), y.ravel(), vertices[:, 2].min() - 1, 1.0
    landed = gw.trace(vertices, faces, rays, ior=block.bench.ior).at_z(block.bench.distance_mm)
    counts, _, _ = np.histogram2d(-landed[:, 1], -landed[:, 0], bins=(12, 16), range=[[-22.5, 22.5], [-30, 30]])
    wanted = block.target.reshape(12, 4, 16, 4).mean(axis=(1, 3))
    assert np.corrcoef(counts[1:-1, 1:-1].ravel(), wanted[1:-1, 1:-1].ravel())[0, 1] > 0.98


def test_light_may_begin_in_the_glass_and_far_away() -> None:
    vertices, faces = ball(60)
    rng = np.random.default_rng(3)
    directions = rng.normal(size=(300, 3))
    inside = gw.trace(vertices, faces, np.hstack([rng.uniform(-0.02, 0.02, (300, 3)), directions]), ior=1.5, fresnel=True)
    assert (inside.how == gw.LEFT).all() and (inside.interfaces == 1).all()
    assert inside.transmittance == pytest.approx(0.96, abs=2e-3)
    far = gw.trace(vertices, faces, np.hstack([-1e7 * directions, directions]), ior=1.5)
    assert (far.how == gw.LEFT).all() and (far.interfaces == 2).all()
    none = gw.trace(vertices, faces, np.zeros((1, 6)), ior=1.5)
    assert none.how[0] == gw.LOST


def test_what_is_no_solid_is_refused() -> None:
    vertices, faces = ball(6)
    rays = along_z(np.zeros(1))
    with pytest.raises(gw.NotASolid, match="open edges"):
        gw.trace(vertices, faces[1:], rays)
    with pytest.raises(gw.NotASolid, match="inside out"):
        gw.trace(vertices, faces[:, ::-1], rays)
    with pytest.raises(gw.BadInput, match="there are 62"):
        gw.trace(vertices[:62], np.where(faces == 3, 4000, faces), rays)
    with pytest.raises(gw.BadInput, match="not finite"):
        gw.trace(np.where(vertices == vertices[5], np.nan, vertices), faces, rays)
    with pytest.raises(gw.BadInput, match="refractive index"):
        gw.trace(vertices, faces, rays, ior=0.5)
    with pytest.raises(gw.BadInput, match=r"\(n, 6\)"):
        gw.trace(vertices, faces, rays[:, :5])
    with pytest.raises(gw.BadInput, match="whole numbers"):
        gw.trace(vertices, faces.astype(float), rays)
    with pytest.raises(gw.BadInput, match="from 0 on"):
        gw.trace(vertices, faces.astype(np.int64) - 1, rays)


def test_heights_come_back_from_their_normals() -> None:
    y, x = np.mgrid[-20:20:81j, -30:30:121j]
    heights = np.sin(0.2 * x) * np.cos(0.15 * y)
    slope_x, slope_y = 0.2 * np.cos(0.2 * x) * np.cos(0.15 * y), -0.15 * np.sin(0.2 * x) * np.sin(0.15 * y)
    length = np.sqrt(1 + slope_x**2 + slope_y**2)
    found = gw.normals_to_heights(-slope_x / length, -slope_y / length, size_mm=(60, 40))
    wanted = heights - heights.mean()
    assert np.abs(found - wanted).max() < 1e-4
    scaled = gw.normals_to_heights(-3 * slope_x, -3 * slope_y, 3 * np.ones_like(x), size_mm=(60, 40))
    assert np.allclose(scaled, found, atol=1e-12)
    with pytest.raises(gw.BadInput, match="face"):
        gw.normals_to_heights(np.ones((5, 5)), np.zeros((5, 5)))
    with pytest.raises(gw.BadInput, match="4 x 4"):
        gw.normals_to_heights(np.zeros((3, 3)), np.zeros((3, 3)))
