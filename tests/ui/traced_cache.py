# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache of the open scene on disk, traced with embree in a moment instead of baked."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.caching.fingerprint import scene_fingerprint
from addon.caching.manifest import Manifest
from addon.caching.plan import Approximation, ChannelPlan
from addon.caching.store import CacheStore
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from tests import synthetic

ALBEDO = 0.6


def _white(points: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.full_like(points, ALBEDO)


def write_traced_cache(
    scene: Any, folder: Path, center: Sequence[float], resolution: int = 128
) -> CacheStore:
    """White Lambert surfaces, seen by one cube camera."""
    geometry = with_render_depsgraph(scene, read_geometry)
    fingerprint = scene_fingerprint(geometry)
    tracer = synthetic.Tracer(geometry)
    plan = ChannelPlan(
        ("depth", "material_id", "normal", "diffuse_color"),
        {},
        geometry.material_names,
        (Approximation("Glass", "is shown as glossy"),),
    )
    cameras = tuple(synthetic.cube_cameras(center, resolution))
    store = CacheStore.create(folder, Manifest(fingerprint, {}, plan, cameras))
    finished = {
        camera.id: store.write_camera(synthetic.trace_framebuffer(geometry, tracer, camera, _white))
        for camera in cameras
    }
    frame = int(scene.frame_current)
    store.write_manifest(Manifest(fingerprint, {}, plan, cameras, finished, frame=frame))
    return store
