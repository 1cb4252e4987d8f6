# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame graph of a relit view: its passes by name, and the inputs that edits touch."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from .frame_graph import FramePass

GEOMETRY = "geometry"
CACHE = "cache"
VIEW = "view"
SAMPLES = "samples"
SURFACE_EDITS = "surface edits"
WORLD = "world"

# Passes that every view has.
VISIBLE_SURFACE = "Visible surface"
CORRESPONDENCE = "Correspondence map"
SURFACES = "Surfaces"
WORLD_LAYER = "World"
EMISSION_LAYER = "Emission"
PICTURE = "Picture"

Part = Literal["shadow casting", "shape", "color"]


def light_input(name: str, part: Part) -> str:
    """The input that an edit of a light touches: what of it changed."""
    return f"{name}: {part}"


def shadow_pass(name: str) -> str:
    """The pass that draws a light's shadow maps."""
    return f"Shadows of {name}"


def layer_pass(name: str) -> str:
    """The pass that draws a light's layer."""
    return f"Light {name}"


@dataclass(frozen=True)
class LightNode:
    """What the graph has to know of a light.

    Attributes:
        name: of the light.
        casts: whether it casts shadows.
        follows_view: whether its shadow maps are fitted to what the view sees, as a sun's are.
    """

    name: str
    casts: bool
    follows_view: bool


def frame_passes(lights: Iterable[LightNode], *, has_emission: bool) -> tuple[FramePass, ...]:
    """The passes of a view lit by some lights, in the order in which they run."""
    passes = [
        FramePass(VISIBLE_SURFACE, (GEOMETRY, VIEW), ("visible surface",), "sample"),
        FramePass(CORRESPONDENCE, ("visible surface", CACHE), ("correspondence",), "sample"),
        FramePass(
            SURFACES, ("visible surface", "correspondence", CACHE), ("surfaces",), "sample"
        ),
    ]  # fmt: skip
    layers, colors = [], []
    seen = ("surfaces", SURFACE_EDITS)
    for light in lights:
        shape, color = light_input(light.name, "shape"), light_input(light.name, "color")
        inputs = [*seen, shape, SAMPLES]
        if light.casts:
            shadows = f"shadow maps of {light.name}"
            reads = [GEOMETRY, light_input(light.name, "shadow casting")]
            reads += ["visible surface"] if light.follows_view else []
            passes.append(
                FramePass(shadow_pass(light.name), tuple(reads), (shadows,), "sample")
            )  # fmt: skip
            inputs.append(shadows)
        layer = f"layer {light.name}"
        passes.append(FramePass(layer_pass(light.name), tuple(inputs), (layer,), "sample"))
        layers.append(layer)
        colors.append(color)
    passes.append(
        FramePass(
            WORLD_LAYER, (*seen, GEOMETRY, WORLD, VIEW, SAMPLES), ("world's layer",), "sample"
        )
    )
    layers.append("world's layer")
    if has_emission:
        passes.append(FramePass(EMISSION_LAYER, (*seen, SAMPLES), ("emission",), "sample"))
        layers.append("emission")
    passes.append(FramePass(PICTURE, (*layers, *colors), ("picture",)))
    return tuple(passes)
