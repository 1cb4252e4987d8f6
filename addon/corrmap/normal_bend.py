# SPDX-License-Identifier: GPL-3.0-or-later
"""By how much the normals of a smooth mesh turn within what a sample of the view stands for.

On a tube two pixels wide they turn by a radian from one pixel to the next, and a highlight is a
tenth of a pixel: sixteen places meet it once or never. What is shaded at a place therefore stands
for a part of the pixel, and lobes are widened by the normals' variance there
(addon/glsl/lib/bend.glsl). The more samples share the pixel, the smaller the part, so that the mean
of very many of them is the highlight itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import PassShader, Samplers, Texture, framebuffer, source, texture_2d
from ..scene.octahedral import GLSL as OCTAHEDRAL_GLSL
from .geometry_buffer import GeometryBuffer
from .pixel_bend import BEND_GLSL, BEND_LIBRARY, LOOK_BLOCK, look_uniforms
from .seen_triangle import seen_textures, with_seen_triangle

if TYPE_CHECKING:
    from .visible_surface import VisibleSurface

# What a pass declares that reads `NormalBend.texture`.
BEND_SAMPLER: Samplers = (("surface_bend", "FLOAT_2D"),)

_PASS = PassShader(
    name="normal_bend",
    fragment="normal_bend",
    library=BEND_LIBRARY,
    generated=OCTAHEDRAL_GLSL + source("lib/seen_corners.glsl") + BEND_GLSL,
    blocks=(LOOK_BLOCK,),
    samplers=(
        ("visible_position", "FLOAT_2D"),
        ("visible_triangle", "FLOAT_2D"),
    ),
    outputs=(("VEC4", "normal_bend"),),
)


class NormalBendPass:
    """Finds by how much normals turn, on a scene of which some is smooth.

    Args:
        geometry: with corner normals.
    """

    def __init__(self, geometry: GeometryBuffer) -> None:
        self._geometry = geometry

    def of(self, visible: VisibleSurface) -> NormalBend:
        """At what is seen."""
        bend = NormalBend(self, visible.position, visible.triangles, visible.eye, visible.pixel)
        return bend if visible.bend is None else bend.knowing(1, visible.bend)

    def draw(self, places: NormalBend, samples: int) -> Texture:
        """See `NormalBend.texture`."""
        geometry = self._geometry
        textures = seen_textures(geometry, corners=True)
        has_copies = geometry.copies is not None
        bend = texture_2d(places.position.width, places.position.height)
        description = with_seen_triangle(_PASS, has_copies, corners=True)
        description.build().draw_fullscreen(
            framebuffer([bend]),
            {
                "visible_position": places.position,
                "visible_triangle": places.triangles,
                **textures,
            },
            {"look": look_uniforms(places.eye, places.pixel, samples)},
        )
        return bend


@dataclass(frozen=True)
class NormalBend:
    """The turns of normals at some places, made when they are asked for.

    Attributes:
        bend_pass: finds them.
        position, triangles, eye, pixel: as of a `VisibleSurface`.
    """

    bend_pass: NormalBendPass
    position: Texture
    triangles: Texture
    eye: NDArray[np.float64]
    pixel: float
    _known: dict[int, Texture] = field(default_factory=dict, compare=False, repr=False)

    def knowing(self, samples: int, texture: Texture) -> NormalBend:
        """The same, with what `texture` is to give for so many samples."""
        self._known[samples] = texture
        return self

    def texture(self, samples: int) -> Texture:
        """RGBA32F: xyz the direction in which normals vary most, as long as their standard
        deviation there, radians, w that across it; 0 where nothing is seen. The last one is kept.

        Args:
            samples: of how many that share a pixel each place is one.
        """
        if samples not in self._known:
            self._known.clear()
            self._known[samples] = self.bend_pass.draw(self, samples)
        return self._known[samples]
