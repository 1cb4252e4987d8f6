# SPDX-License-Identifier: GPL-3.0-or-later
"""What each object gets of a light, and which objects cast its shadows, for the passes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...corrmap.surface_buffer import SurfaceBuffer
from ...corrmap.surface_layout import OBJECT_SAMPLER
from ...glsl.shader import Samplers, texture_from_array
from ...scene.geometry import SceneGeometry
from ...scene.light import Light
from ...scene.light_linking import blockers, receiver_weights

# Texels in a row of the table of objects; see addon/glsl/lib/object_share.glsl.
_ROW = 1024

# What a pass declares that reads the table: SurfaceBuffer.objects, and the table.
OBJECT_SAMPLERS: Samplers = (OBJECT_SAMPLER, ("object_table", "FLOAT_2D"))


def object_textures(surface: SurfaceBuffer, table: Any) -> dict[str, Any]:
    """The textures of OBJECT_SAMPLERS, for surfaces that have their `objects`; none without a
    table."""
    if table is None:
        return {}
    if surface.objects is None:
        raise ValueError("the surfaces do not say which objects they are")
    return {OBJECT_SAMPLER[0]: surface.objects, "object_table": table}


# Lights that are linked alike have one table. Edits leave tables behind, so that there is an end.
_MOST_KEPT = 256


@dataclass(frozen=True)
class ObjectShares:
    """How the objects of a scene differ to one light.

    Attributes:
        weights: (N, 2) float64, how much each of the N objects gets: diffuse, specular.
        blocks: (N,) whether it casts this light's shadows, and stands in its own light.
        casters: `blocks` for `GeometryBuffer.draw`; None where all that cast any shadow do.
        texture: `weights` and `blocks` for the passes; None where no visible object differs
            from one that gets all and casts.
    """

    weights: NDArray[np.float64]
    blocks: NDArray[np.bool_]
    casters: NDArray[np.bool_] | None
    texture: Any


class LightObjects:
    """The shares of one scene's objects in its lights. Needs a GPU context."""

    def __init__(self, geometry: SceneGeometry) -> None:
        self._geometry = geometry
        self._known: dict[Any, ObjectShares] = {}
        count = len(geometry.object_names)
        self._visible = np.zeros(count, dtype=np.bool_)
        self._visible[geometry.object_id[geometry.camera_visible]] = True
        self._casts = np.zeros(count, dtype=np.bool_)
        self._casts[geometry.object_id[geometry.shadow_visible]] = True

    def of(self, light: Light) -> ObjectShares:
        """The shares in one light."""
        key = (light.linking, light.use_shadow)
        if key not in self._known:
            if len(self._known) >= _MOST_KEPT:
                self._known.clear()
            self._known[key] = self._read(light)
        return self._known[key]

    def caster_triangles(self, light: Light) -> NDArray[np.bool_] | None:
        """(T,) which triangles cast a light's shadows; None for all that cast any."""
        casters = self.of(light).casters
        if casters is None:
            return None
        return np.asarray(casters[self._geometry.object_id] & self._geometry.shadow_visible)

    def _read(self, light: Light) -> ObjectShares:
        weights = receiver_weights(light.linking, self._geometry)
        linked = blockers(light.linking, self._geometry)
        blocks = linked & self._casts
        differs = (weights != 1.0).any(axis=1)
        if light.use_shadow:
            differs |= ~blocks
        return ObjectShares(
            weights,
            blocks,
            None if linked[self._casts].all() else linked,
            _table(weights, blocks) if differs[self._visible].any() else None,
        )


def _table(weights: NDArray[np.float64], blocks: NDArray[np.bool_]) -> Any:
    """RGBA32F, rows of _ROW objects: weights, and whether it stands in its own light."""
    count = len(weights)
    width = min(count, _ROW)
    rows = np.zeros((-(-count // width) * width, 4), dtype=np.float32)
    rows[:count, :2], rows[:count, 2] = weights, blocks
    return texture_from_array(rows.reshape(-1, width, 4), "RGBA32F")
