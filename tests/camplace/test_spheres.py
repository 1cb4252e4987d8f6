# SPDX-License-Identifier: GPL-3.0-or-later
"""Maximal spheres whose place and size are known."""

from __future__ import annotations

import numpy as np

from addon.camplace.area_samples import sample_area
from addon.camplace.rays import RayCaster
from addon.camplace.spheres import escape_direction, find_spheres, grow_spheres
from addon.camplace.surface_distance import SurfaceDistance
from addon.scene.closest_point import closest_on_triangle
from addon.scene.geometry import SceneGeometry
from tests.synthetic import box, geometry_of

# Moves end at 1/8192 of the diagonal, and the radius changes no faster than the centre moves.
MOVE = 4.0 / 8192.0


def _surface(geometry: SceneGeometry) -> SurfaceDistance:
    points, triangle = sample_area(
        geometry, np.ones(len(geometry)), geometry.bounds, 4000, np.random.default_rng(0)
    )
    return SurfaceDistance(geometry, RayCaster(geometry), points, triangle)


def test_in_a_cube() -> None:
    geometry = geometry_of([box((1.0, 2.0, 3.0), 2.0)])
    surface = _surface(geometry)
    bounds = geometry.bounds + np.array([[-0.1], [0.1]])
    seeds = np.array([[0.1, 1.1, 2.1], [1.9, 2.5, 3.0], [1.0, 2.0, 2.02], [1.3, 1.2, 3.9]])
    spheres = grow_spheres(surface, bounds, seeds)
    diagonal = np.linalg.norm(bounds[1] - bounds[0])
    np.testing.assert_allclose(spheres.centre, np.tile([1.0, 2.0, 3.0], (4, 1)), atol=MOVE * 4)
    np.testing.assert_allclose(spheres.radius, 1.0, atol=diagonal / 8192)


def test_one_sphere_is_found_in_a_cube() -> None:
    geometry = geometry_of([box((0.0, 0.0, 0.0), 2.0)])
    point, triangle = sample_area(
        geometry, np.ones(12), geometry.bounds, 500, np.random.default_rng(1)
    )
    inwards = -geometry.normal[triangle]
    inwards *= -np.sign(np.einsum("sx,sx->s", inwards, point))[:, None]
    spheres = find_spheres(
        _surface(geometry),
        geometry.bounds * 1.1,
        point,
        inwards,
        searches=50,
        rng=np.random.default_rng(2),
    )
    assert len(spheres) == 1
    np.testing.assert_allclose(spheres.radius, 1.0, atol=MOVE * 4)


def test_between_two_plates_the_box_bounds_the_rest() -> None:
    """Every sphere between the plates is held by both, wherever it stands along them."""
    plate = np.array([[-5.0, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0]])
    sides = np.array([[0, 1, 2], [0, 2, 3]])
    geometry = geometry_of([(plate, sides), (np.add(plate, (0, 0, 1.0)), sides)])
    seeds = np.array([[0.0, 0.0, 0.1], [3.0, -2.0, 0.9], [-4.9, 4.9, 0.5]])
    bounds = np.array([[-5.0, -5, -3], [5, 5, 4]])
    spheres = grow_spheres(_surface(geometry), bounds, seeds)
    np.testing.assert_allclose(spheres.radius, 0.5, atol=0.01)
    np.testing.assert_allclose(spheres.centre[:, 2], 0.5, atol=0.01)
    assert (np.abs(spheres.centre[:, :2]) <= 4.51).all()


def test_in_an_l_shaped_room() -> None:
    """A square of side 2 without a quarter: legs 1 wide, high enough not to matter.

    In the bend a sphere touches both outer walls and the inner edge: c = sqrt(2) (1 - c), so
    its radius and its distance from the walls are 2 - sqrt(2). In a leg both walls hold it.
    """
    plan = np.array([[0.0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]])
    low = np.column_stack([plan, np.zeros(6)])
    corners = np.concatenate([low, np.add(low, (0.0, 0.0, 3.0))])
    walls = [[i, (i + 1) % 6, (i + 1) % 6 + 6] for i in range(6)]
    walls += [[i, (i + 1) % 6 + 6, i + 6] for i in range(6)]
    floor = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]
    triangles = np.array([*walls, *floor, *(np.array(floor) + 6).tolist()])
    geometry = geometry_of([(corners, triangles)])
    bounds = geometry.bounds + np.array([[-0.1], [0.1]])
    seeds = np.array([[0.2, 0.25, 1.5], [0.45, 0.3, 1.4], [1.7, 0.2, 1.5], [0.3, 1.8, 1.6]])
    spheres = grow_spheres(_surface(geometry), bounds, seeds)
    bend = 2.0 - np.sqrt(2.0)
    np.testing.assert_allclose(spheres.radius, [bend, bend, 0.5, 0.5], atol=0.01)
    np.testing.assert_allclose(spheres.centre[:2, :2], bend, atol=0.01)
    np.testing.assert_allclose([spheres.centre[2, 1], spheres.centre[3, 0]], 0.5, atol=0.01)


def test_a_sphere_stays_on_its_side_of_a_sheet() -> None:
    sheet = np.array([[-5.0, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0]])
    geometry = geometry_of([(sheet, np.array([[0, 1, 2], [0, 2, 3]]))])
    bounds = np.array([[-5.0, -5, -8], [5, 5, 2]])
    spheres = grow_spheres(_surface(geometry), bounds, np.array([[0.5, 0.2, 0.05]]))
    # Above the sheet there is room for a radius of 1, below for 4.
    np.testing.assert_allclose(spheres.radius, 1.0, atol=0.01)
    assert spheres.centre[0, 2] > 0.0


def test_escape_directions_in_closed_form() -> None:
    contacts = np.full((3, 3, 3), np.inf)
    contacts[0, 0] = [0.0, 0.0, -1.0]
    contacts[1, :2] = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
    contacts[2, :2] = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]
    away, freedom = escape_direction(contacts, np.full(3, 1.1))
    np.testing.assert_allclose(away[0], [0.0, 0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(away[1], np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0), atol=1e-9)
    np.testing.assert_allclose(freedom, [1.0, np.sqrt(0.5), 0.0], atol=1e-9)


def test_equation_one_holds_for_random_contacts() -> None:
    rng = np.random.default_rng(5)
    contacts = rng.normal(size=(200, 6, 3)) + rng.normal(size=(200, 1, 3)) * 2.0
    contacts /= np.linalg.norm(contacts, axis=-1, keepdims=True)
    away, freedom = escape_direction(contacts, np.full(200, 1.01))
    worst = np.einsum("nkx,nx->nk", contacts, away).max(axis=-1)
    free = freedom > 0.1
    assert free.sum() > 50
    # Gilbert's algorithm stops early; a tenth of a move towards a contact is cut back by the
    # next, shorter move.
    assert (worst[free] <= 0.1).all()


def test_nearest_point_on_a_triangle_against_a_dense_search() -> None:
    rng = np.random.default_rng(7)
    corners = rng.normal(size=(50, 3, 3))
    place = rng.normal(size=(50, 3)) * 2.0
    near = closest_on_triangle(place, corners)
    steps = np.linspace(0.0, 1.0, 120)
    u, v = np.meshgrid(steps, steps)
    weights = np.stack([1.0 - u - v, u, v], axis=-1)[u + v <= 1.0 + 1e-12]
    dense = np.einsum("wc,ncx->nwx", weights, corners)
    least = np.linalg.norm(dense - place[:, None], axis=-1).min(axis=-1)
    distance = np.linalg.norm(near - place, axis=-1)
    assert (distance <= least + 1e-12).all()
    # The raster's spacing is 1/120 of edges of a few units; half of it is missed at most.
    np.testing.assert_allclose(distance, least, atol=0.03)
