# SPDX-License-Identifier: GPL-3.0-or-later
"""Very bright, very dark and very many materials come through disk and GPU as they are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.manifest import Manifest
from addon.caching.plan import ChannelPlan
from addon.caching.store import CacheStore
from addon.errors import InputError
from addon.scene.light import Light
from tests import synthetic

LAMP = np.array([0.0, 0.5, 1.5])
# 1-based, these are 2051 and 2052: half precision would make 2052 of both.
LEFT, RIGHT = 2050, 2051
PLAIN = 0.75
WIDTH, HEIGHT = 64, 48


def relit(tmp_path: Path, albedo: float, energy: float, names: int) -> NDArray[np.float32]:
    """(H, W): two squares side by side; the left one has the albedo, the right one PLAIN."""
    from addon.relight.session import RelightSession

    square = np.array([[0.0, -2, 0], [2.0, -2, 0], [2.0, 2, 0], [0.0, 2, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    geometry = synthetic.geometry_of([(square - (2.0, 0.0, 0.0), faces), (square, faces)])
    geometry = replace(
        geometry,
        material_id=np.where(geometry.material_id == 0, LEFT, RIGHT).astype(np.int32),
        material_names=tuple(f"material {number}" for number in range(names)),
    )

    def color(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(points[:, :1] < 0.0, albedo, PLAIN) * np.ones(3)

    tracer = synthetic.Tracer(geometry)
    cameras = tuple(synthetic.cube_cameras((0.1, 0.0, 2.0), 64))
    plan = ChannelPlan(
        ("depth", "material_id", "normal", "diffuse_color"), {}, geometry.material_names
    )
    store = CacheStore.create(tmp_path / "cache", Manifest("", {}, plan, cameras))
    for camera in cameras:
        store.add_camera(synthetic.trace_framebuffer(geometry, tracer, camera, color))
    session = RelightSession(geometry, CacheStore.open(store.folder), samples=1)
    session.set_view(VIEW)
    session.set_world(None)
    world_from_light = np.eye(4)
    world_from_light[:3, 3] = LAMP
    session.set_lights([Light("Lamp", "POINT", world_from_light, energy, np.ones(3))])
    return session.render().combined[..., 0]


VIEW = synthetic.perspective_view(
    synthetic.looking_at((0.0, -0.3, 2.5), (0.0, 0.0, 0.0)), WIDTH, HEIGHT, 0.7
)


@pytest.mark.parametrize(("albedo", "energy"), [(1e-9, 1e9), (3e-6, 1.0), (1e9, 1e-9)])
def test_no_albedo_is_clamped_flushed_or_mixed(
    gpu_context: None, tmp_path: Path, albedo: float, energy: float
) -> None:
    picture = relit(tmp_path, albedo, energy, RIGHT + 1)
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    origin, direction = VIEW.rays(np.stack([x, y], axis=-1))
    hit = origin - direction * (origin[..., 2] / direction[..., 2])[..., None]
    distance = np.linalg.norm(LAMP - hit, axis=-1)
    shown = np.where(hit[..., 0] < 0.0, albedo, PLAIN)
    # L = rho Phi cos(theta) / (4 pi^2 d^2), as Cycles has it.
    expected = shown * energy * (LAMP[2] / distance) / (4.0 * np.pi**2 * distance**2)
    # At the border, where it would show, no texel of the one material reaches the other.
    # Half precision of the plain albedo is exact; the rest is float32.
    np.testing.assert_allclose(picture, expected, rtol=5e-5)


def test_more_materials_than_the_gpu_can_number(gpu_context: None, tmp_path: Path) -> None:
    import gpu

    limit = gpu.capabilities.max_texture_size_get()
    with pytest.raises(InputError, match="materials do not fit this GPU's textures"):
        relit(tmp_path, 0.5, 1.0, limit - 1)
