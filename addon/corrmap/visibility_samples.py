# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility samples of a view: through which point of the lens, and when.

A picture is the mean over samples of what they see (Lightspeed, section 4.3; R. Cook, T. Porter,
L. Carpenter, "Distributed Ray Tracing", 1984). All pixels of a sample look through the same point
of the lens at the same time, so that a sample is one rasterized view: a camera beside the view's
own, its projection sheared so that the plane in focus stays where it is (P. Haeberli, K. Akeley,
"The Accumulation Buffer", 1990).

Positions come out where the geometry has them, whatever the time: that is where surfaces are
shaded, so that samples of one surface at several times share what is shaded.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..scene.exposure import Exposure
from ..scene.view import View
from .pixel_filter import pixel_offsets
from .visible_surface import VisibleSurface, VisibleSurfacePass, local_eye

# Lens and time step by the R_d sequence (M. Roberts, "The Unreasonable Effectiveness of Quasirandom
# Sequences", 2018) of three dimensions: the root of x^4 = x + 1. In the pixel, samples are Sobol's
# points, so that the two never run in step.
_ROOT = 1.2207440846057596
_GENERATOR = _ROOT ** -np.arange(1.0, 4.0)


@dataclass(frozen=True)
class VisibilitySample:
    """One look at the scene.

    Attributes:
        view: through one point of the lens, at one time.
        offset: in the pixel, (x, y) pixels from its centre.
        moved: (O, 4, 4) float64, where each object's points are then, from where the geometry has
            them, world space; None if they are there.
    """

    view: View
    offset: tuple[float, float]
    moved: NDArray[np.float64] | None = None


def visibility_sample(
    view: View, k: int, exposure: Exposure | None = None, objects: int = 0
) -> VisibilitySample:
    """Sample `k` of a view, all of equal weight; sample 0 is the view itself at the pixels'
    centres.

    Args:
        view: the reference: the frame's own camera, through the middle of its lens.
        k: which.
        exposure: what moves, if anything does.
        objects: how many the geometry has.
    """
    if k == 0:
        return VisibilitySample(view, (0.0, 0.0))
    x, y = pixel_offsets(view.pixel_filter, 1, first=k)[0]
    u, v, when = (0.5 + k * _GENERATOR) % 1.0
    looking, moved = view, None
    if exposure is not None:
        time = exposure.time(float(when))
        looking = replace(exposure.view(time), lens=view.lens)
        moved = exposure.moved_from_reference(time, objects)
    if view.lens is not None:
        right, up = view.lens.points(np.array([[u, v]]))[0]
        looking = through_lens(looking, float(right), float(up))
    return VisibilitySample(looking, (float(x), float(y)), moved)


def through_lens(view: View, right: float, up: float) -> View:
    """The view through a point of its lens, metres from the middle; what lies at the distance in
    focus keeps its place in the picture.

    Raises:
        ValueError: the view has no lens.
    """
    if view.lens is None:
        raise ValueError("a view without a lens has only its middle")
    shift, focus = np.array([right, up]), view.lens.focus_distance
    world_from_camera, matrix = view.world_from_camera.copy(), view.clip_from_camera.copy()
    # At a depth of `focus`, a row's product with (x - shift) and z is what it was with x and z.
    matrix[:2, 2] -= matrix[:2, :2] @ shift / focus
    if view.perspective:
        world_from_camera[:3, 3] += world_from_camera[:3, :2] @ shift
    else:
        matrix[:2, 3] -= matrix[:2, :2] @ shift
    return replace(view, world_from_camera=world_from_camera, clip_from_camera=matrix)


def draw_visibility_sample(
    surfaces: VisibleSurfacePass,
    view: View,
    sample: VisibilitySample,
    *,
    with_objects: bool = False,
) -> VisibleSurface:
    """What a sample sees, its positions as the geometry has them, and to be shaded as seen from
    `view`, the reference."""
    drawn = surfaces.draw(sample.view, sample.offset, with_objects=with_objects, moved=sample.moved)
    eye = local_eye(view, surfaces.origin)
    before = tuple(replace(layer, eye=eye) for layer in drawn.before)
    return replace(drawn, eye=eye, before=before)
