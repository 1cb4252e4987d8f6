# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of `directional_albedo` on the GPU, shared by the passes that read them."""

from __future__ import annotations

from functools import cached_property
from typing import Any

from ..glsl.shader import SamplerType, texture_from_array
from .directional_albedo import albedo_tables

ALBEDO_SAMPLERS: tuple[tuple[str, SamplerType], ...] = (
    ("microfacet_table", "FLOAT_2D"),
    ("dielectric_table", "FLOAT_2D"),
)


class AlbedoTextures:
    """Made when first used; one object serves all passes."""

    @cached_property
    def textures(self) -> dict[str, Any]:
        """By sampler name."""
        tables = albedo_tables()
        return {
            "microfacet_table": texture_from_array(tables.microfacet, "RGBA32F"),
            "dielectric_table": texture_from_array(tables.dielectric, "R32F"),
        }
