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

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import PassShader, Samplers, Texture, framebuffer, source, texture_2d
from ..glsl.uniforms import Field, UniformBlock
from ..scene.octahedral import GLSL as OCTAHEDRAL_GLSL
from .corner_normal_table import CORNER_SAMPLERS
from .geometry_buffer import GeometryBuffer
from .visible_surface import VisibleSurface

# What a pass declares that reads `NormalBend.texture`.
BEND_SAMPLER: Samplers = (("surface_bend", "FLOAT_2D"),)

# The standard deviation of a part, in widths of a square of its area: of the square itself it is
# 0.29. Places are not spread as evenly as such squares, and neighbouring parts had better overlap.
DEVIATION = 0.7

_PASS = PassShader(
    name="normal_bend",
    fragment="normal_bend",
    library=("frame_across", "ellipse"),
    generated=OCTAHEDRAL_GLSL + source("lib/corner_bend.glsl"),
    blocks=(UniformBlock("look", (Field("vec4", "eye"), Field("float", "deviation"))),),
    samplers=(
        ("visible_position", "FLOAT_2D"),
        ("visible_triangle", "FLOAT_2D"),
        ("triangle_plane", "FLOAT_2D"),
        *CORNER_SAMPLERS,
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
        eye, pixel = visible.eye, visible.pixel
        return NormalBend(self, visible.position, visible.triangles, eye, pixel)

    def draw(self, places: NormalBend, samples: int) -> Texture:
        """See `NormalBend.texture`."""
        corners = self._geometry.corner_normals
        if corners is None:
            raise ValueError("the geometry has no corner normals")
        deviation = DEVIATION * places.pixel / samples**0.5
        bend = texture_2d(places.position.width, places.position.height)
        _PASS.build().draw_fullscreen(
            framebuffer([bend]),
            {
                "visible_position": places.position,
                "visible_triangle": places.triangles,
                "triangle_plane": self._geometry.table.plane,
                **corners.textures(),
            },
            {"look": {"eye": places.eye, "deviation": deviation}},
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
