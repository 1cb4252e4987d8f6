# SPDX-License-Identifier: GPL-3.0-or-later
"""The twin of addon/glsl/lib/surface_edit.glsl: edited surfaces, in float64.

Written from what addon/scene/surface_edit.py says: a lobe's reflectance is a dielectric's and a
metal's or a glossy reflection's, and each is what the same shader with other inputs would have.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from addon.caching.channels import ViewCurve, lobe_channel
from addon.scene.surface_edit import SurfaceEdit

from .surfaces import Surfaces

Array = NDArray[np.float64]

_SAME = 1.0 / 256.0


def edited(surfaces: Surfaces, *edits: SurfaceEdit) -> Surfaces:
    """Surfaces after the edits of their material and, if there is one, of their object."""
    color = np.prod([edit.color_factor for edit in edits], axis=0)
    specular = np.prod([edit.specular_factor for edit in edits], axis=0)
    channels = dict(surfaces.channels)
    glow = float(np.prod([edit.emission for edit in edits]))
    if "emission" in channels:
        channels["emission"] = channels["emission"] * glow
    for number in range(1, surfaces.lobes + 1):
        for field, values in _lobe(surfaces, number, color, specular, edits).items():
            channels[lobe_channel(field, number)] = values
    return replace(surfaces, channels=channels)


def _rough(roughness: Array, edits: tuple[SurfaceEdit, ...]) -> Array:
    for edit in edits:
        roughness = roughness * edit.roughness + edit.roughness_offset
    return np.clip(roughness, 0.0, 1.0)


def _lobe(
    surfaces: Surfaces, number: int, color: Array, specular: Array, edits: tuple[SurfaceEdit, ...]
) -> dict[str, Array]:
    def get(field: str) -> Array:
        values = surfaces.channel(field, number)
        return values if values.ndim == 3 else values[..., None]

    strongest = specular.max()
    layer0, layer90, share = get("layer_f0"), get("layer_f90"), get("specular_share")
    f0, f90 = get("specular_f0"), get("specular_f90")
    covered = get("dielectric") * layer90
    # The dielectric's part, and the metal's.
    rest90 = np.maximum(f90 - covered, 0.0)
    has_metal = rest90.max(axis=-1, keepdims=True) > _SAME * covered
    d90 = np.where(has_metal, np.minimum(f90, covered), f90)
    d0 = np.where(has_metal, np.minimum(f0, get("dielectric") * layer0), f0)
    m90 = np.where(has_metal, rest90, 0.0)
    m0 = np.maximum(f0 - d0, 0.0)
    m_share = np.where(has_metal, np.maximum(share - covered, 0.0), 0.0)
    d_share = share - m_share
    # The metal with another base colour; a glossy reflection with another colour.
    glossy = m0 >= m90 * (1.0 - _SAME)
    new_m0 = np.where(glossy, m0 * color, np.minimum(m0 * color, m90))
    new_m90 = np.where(glossy, m90 * color, m90)
    w = (6.0 / 7.0) ** 5
    schlick, new_schlick = m0 + (m90 - m0) * w, new_m0 + (new_m90 - new_m0) * w
    dip = get("specular_dip") * new_schlick / np.maximum(schlick, 1e-20)
    # The dielectric with another level and tint.
    largest = d0.max(axis=-1, keepdims=True)
    new_largest = (d0 * specular).max(axis=-1, keepdims=True)
    factor = np.where(largest > 0.0, new_largest / np.maximum(largest, 1e-300), strongest)
    there = float(strongest > 0.0)
    new_d0, new_d90 = np.minimum(d0 * specular, d90) * there, d90 * there
    curve, roughness = get("view_curve"), get("roughness")
    coat, sheen = curve == ViewCurve.COAT, curve == ViewCurve.SHEEN
    parameter, slope = get("view_parameter"), get("view_slope")
    return {
        "diffuse_color": get("diffuse_color") * color,
        "translucent_color": get("translucent_color") * color,
        "sheen_color": get("sheen_color") * color,
        "specular_f0": new_d0 + new_m0 * specular,
        "specular_f90": new_d90 + new_m90 * specular,
        "specular_dip": dip * specular,
        "specular_share": d_share * there + m_share * strongest,
        "layer_f0": np.minimum(layer0 * factor, layer90) * there,
        "layer_f90": layer90 * there,
        "roughness": _rough(roughness, edits),
        "view_parameter": np.where(coat, np.minimum(parameter * strongest, 1.0), parameter),
        "view_slope": slope * np.where(sheen, color.max(), np.where(coat, there, 1.0)),
        "view_roughness": np.where(
            coat, _rough(get("view_roughness"), edits), get("view_roughness")
        ),
    }
