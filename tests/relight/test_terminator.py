# SPDX-License-Identifier: GPL-3.0-or-later
"""Where shadow rays start on smoothly shaded surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.relight.shadows.terminator import SmoothReceivers
from addon.scene.geometry import TERMINATOR_OFFSET, SceneGeometry
from addon.scene.octahedral import from_codes, to_codes
from tests.reference import terminator as twin
from tests.reference.shading_normal import shading_normals
from tests.synthetic import geometry_of

Array = NDArray[np.float64]

# Of two 16-bit numbers (`octahedral`), in radians.
CODE_ERROR = 7e-5


def soup(count: int = 400, *, lean: float = 0.5, seed: int = 0) -> SceneGeometry:
    """Triangles anywhere, their corners' normals leaning anyhow."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(3 * count, 3))
    geometry = geometry_of([(corners, np.arange(3 * count).reshape(-1, 3))])
    normals = geometry.normal[:, None] + lean * rng.normal(size=(count, 3, 3))
    return replace(geometry, corner_normals=to_codes(normals))


def ball(rings: int = 12) -> SceneGeometry:
    """A unit ball with its own normals."""
    angle = np.linspace(0.0, np.pi, rings + 1)
    around = np.linspace(0.0, 2.0 * np.pi, 2 * rings + 1)[:-1]
    ring, turn = np.meshgrid(angle, around, indexing="ij")
    points = np.stack(
        [np.sin(ring) * np.cos(turn), np.sin(ring) * np.sin(turn), np.cos(ring)], axis=-1
    ).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings), np.arange(2 * rings), indexing="ij")
    a, b = i * 2 * rings + j, i * 2 * rings + (j + 1) % (2 * rings)
    c, d = a + 2 * rings, b + 2 * rings
    faces = np.concatenate([np.stack([a, c, d], -1)[1:-1], np.stack([a, d, b], -1)[1:-1]], axis=0)
    geometry = geometry_of([(points, faces.reshape(-1, 3))])
    corners = geometry.vertices[geometry.triangles]
    assert ((corners.mean(axis=1) * geometry.normal).sum(axis=1) > 0.0).all()
    return replace(geometry, corner_normals=to_codes(corners))


def places_on(geometry: SceneGeometry, seed: int = 1) -> Array:
    """(T, 3) one in each triangle."""
    share = np.random.default_rng(seed).dirichlet((1.0, 1.0, 1.0), len(geometry))
    return np.asarray(
        np.einsum("tk,tkx->tx", share, geometry.vertices[geometry.triangles])
    )  # fmt: skip


def receivers(geometry: SceneGeometry, place: Array, facing: Array) -> SmoothReceivers:
    return SmoothReceivers(geometry, np.arange(len(geometry), dtype=np.int32), place.T, facing.T)


def lifts(smooth: SmoothReceivers, toward: Array, side: NDArray[np.floating]) -> Array:
    """(R, 3) of all receivers."""
    some, lift = smooth.lift(np.arange(len(toward)), np.ascontiguousarray(toward.T), side)
    result = np.zeros(toward.shape)
    result[some] = lift.T
    return result


def directions(count: int, seed: int = 2) -> Array:
    toward = np.random.default_rng(seed).normal(size=(count, 3))
    return np.asarray(toward / np.linalg.norm(toward, axis=1, keepdims=True))


def test_normals_are_interpolated() -> None:
    geometry = soup()
    place, rows = places_on(geometry), np.arange(len(geometry))
    back = np.where(rows % 2, -1.0, 1.0)[:, None]
    found = receivers(geometry, place, back * geometry.normal).normal.T
    expected = back * shading_normals(geometry, rows, place)
    # (A unit vector in float32.)
    assert np.abs(found - expected).max() < 1e-6


def test_the_side_is_that_of_the_interpolated_normal() -> None:
    geometry = soup(lean=1.0)
    place, rows = places_on(geometry), np.arange(len(geometry))
    smooth = receivers(geometry, place, geometry.normal)
    toward = directions(len(geometry))
    expected = np.sign((shading_normals(geometry, rows, place) * toward).sum(axis=1))
    assert np.array_equal(smooth.side(rows, toward.T), expected)
    # Or else this would not tell the two normals apart.
    assert (expected != np.sign((geometry.normal * toward).sum(axis=1))).mean() > 0.05


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
@pytest.mark.parametrize("cutoff", [TERMINATOR_OFFSET, 0.7])
def test_lifts_are_cycles(cutoff: float, scale: float) -> None:
    """On both sides, seen from either, near the terminator and away from it."""
    geometry = soup(800)
    geometry = replace(
        geometry,
        vertices=scale * geometry.vertices,
        terminator_offset=np.array([cutoff], dtype=np.float32),
    )
    place, rows = places_on(geometry), np.arange(len(geometry))
    facing = np.where(rows % 2, -1.0, 1.0)[:, None] * geometry.normal
    smooth = receivers(geometry, place, facing)
    toward = directions(len(geometry))
    found = lifts(smooth, toward, smooth.side(rows, toward.T))
    assert geometry.corner_normals is not None
    normals = from_codes(geometry.corner_normals).astype(np.float64)
    corners = geometry.vertices[geometry.triangles]
    cutoff = float(np.float32(cutoff))
    each = zip(corners, normals, place, facing, toward, strict=True)
    expected = np.array([
        twin.lift(*of_triangle, toward=L, cutoff=cutoff) for *of_triangle, L in each
    ])  # fmt: skip
    # Cosines with a unit vector in float32, over the cutoff; heights are some units.
    assert np.abs(found - expected).max() < 1e-5 * scale
    lifted = np.linalg.norm(expected, axis=1) > 0.0
    assert 0.05 < lifted.mean() < 0.95


def test_rays_from_a_ball_start_outside_of_it() -> None:
    """Where light grazes facets: above the ball itself, and at most as far above it as two facets
    lie below it (tangents at a facet's corners meet above its middle)."""
    geometry = ball()
    place, rows = places_on(geometry), np.arange(len(geometry))
    smooth = receivers(geometry, place, geometry.normal)
    toward = np.cross(smooth.normal.T, [0.3, 0.5, 0.8]) + 1e-3 * smooth.normal.T
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    grazed = (geometry.normal * toward).sum(axis=1) < TERMINATOR_OFFSET
    assert grazed.mean() > 0.5
    lift = lifts(smooth, toward, np.ones(len(rows)))
    radius = np.linalg.norm(place + lift, axis=1)[grazed]
    depth = (1.0 - (geometry.normal * place).sum(axis=1))[grazed]
    assert (radius > 1.0 - CODE_ERROR).all()
    assert (radius < 1.0 + 2.0 * depth).all()


@pytest.mark.parametrize(
    "why", ["flat", "no corner normals", "unknown", "no offset", "in the light"]
)
def test_other_rays_start_where_they_are(why: str) -> None:
    geometry = ball()
    place, rows = places_on(geometry), np.arange(len(geometry))
    toward = np.cross(geometry.normal, [0.3, 0.5, 0.8])
    triangle = rows.astype(np.int32)
    if why == "flat":
        geometry = replace(
            geometry, corner_normals=to_codes(np.repeat(geometry.normal[:, None], 3, axis=1))
        )
    elif why == "no corner normals":
        geometry = replace(geometry, corner_normals=None)
    elif why == "unknown":
        triangle[:] = -1
    elif why == "no offset":
        geometry = replace(geometry, terminator_offset=np.zeros(1, dtype=np.float32))
    else:
        toward = toward + geometry.normal
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    smooth = SmoothReceivers(geometry, triangle, place.T, geometry.normal.T)
    assert not lifts(smooth, toward, np.ones(len(rows))).any()
    if why in ("flat", "no corner normals", "unknown"):
        assert np.allclose(smooth.normal.T, geometry.normal, atol=1e-7)
