# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of `directional_albedo` and of the sheen on the GPU, for the passes that read them."""

from __future__ import annotations

from functools import cached_property
from typing import Any

from ...corrmap.surface_layout import SurfaceLayout
from ...glsl.shader import Samplers, texture_from_array
from .directional_albedo import albedo_tables
from .sheen_table import sheen_table


def table_samplers(layout: SurfaceLayout, ambient: bool = False) -> Samplers:
    """Sampler declarations of a pass that shades surfaces of this layout: the tables of the
    specular terms for specular lobes and coats (and for the world's light), the sheen's for it."""
    specular: Samplers = (("microfacet_table", "FLOAT_2D"), ("dielectric_table", "FLOAT_2D"))
    sheen: Samplers = (("sheen_table", "FLOAT_2D"),)
    reads_specular = ambient or layout.has("HAS_SPECULAR") or layout.has("HAS_VIEW_WEIGHT")
    return (*(specular if reads_specular else ()), *(sheen if layout.has("HAS_SHEEN") else ()))


def table_library(layout: SurfaceLayout, ambient: bool = False) -> tuple[str, ...]:
    """The files under addon/glsl/lib/ that read them, and shade with them."""
    names = {name for name, _ in table_samplers(layout, ambient)}
    return (
        *(("bilinear",) if names else ()),
        *(("albedo_table", "bsdf") if "microfacet_table" in names else ()),
        *(("sheen",) if "sheen_table" in names else ()),
        *(("view_weight",) if "microfacet_table" in names else ()),
    )


class AlbedoTextures:
    """Made when first used; one object serves all passes."""

    def textures(self, layout: SurfaceLayout, ambient: bool = False) -> dict[str, Any]:
        """Those of `table_samplers`, by sampler name."""
        return {name: self._all[name] for name, _ in table_samplers(layout, ambient)}

    @cached_property
    def _all(self) -> dict[str, Any]:
        tables = albedo_tables()
        return {
            "microfacet_table": texture_from_array(tables.microfacet, "RGBA32F"),
            "dielectric_table": texture_from_array(tables.dielectric, "R32F"),
            "sheen_table": texture_from_array(sheen_table(), "RGBA32F"),
        }
