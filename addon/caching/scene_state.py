# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene as it is at one frame, read to be baked and to be compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..scene.geometry import SceneGeometry
from .surfaces import ObjectState, Surfaces


@dataclass(frozen=True)
class SceneState:
    """One state.

    Attributes:
        frame: at which it is so.
        geometry: the triangles.
        states: of each of `geometry.object_names`.
        surfaces: the states of the objects and of their materials.
    """

    frame: int
    geometry: SceneGeometry
    states: Sequence[ObjectState]
    surfaces: Surfaces

    @property
    def fingerprint(self) -> str:
        """Of its surfaces."""
        return self.surfaces.fingerprint
