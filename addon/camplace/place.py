# SPDX-License-Identifier: GPL-3.0-or-later
"""Places caching cameras for a shot (paper section III.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..progress import Progress, silent
from ..scene.geometry import SceneGeometry
from ..scene.view import View
from .aim import clip_distances, needed_resolution
from .box import inside_box
from .camera import CachingCamera
from .choose import Choice, choose_primaries, choose_secondaries
from .coverage import Seen, joined
from .frame import LocalFrame
from .placement import Placement
from .prepare import Stage, prepare
from .settings import PlacementSettings
from .spheres import Spheres, find_spheres
from .surface_distance import sphere_directions

# Directions in which a camera looks for the surface nearest to it.
STAR = 256
# Less of the views' pixels covered than this is worth a warning: the rest will be holes.
ENOUGH = 0.98


def place_cameras(
    geometry: SceneGeometry,
    views: Sequence[View],
    settings: PlacementSettings,
    progress: Progress = silent,
) -> Placement:
    """Choose caching cameras that see what the views see, sharply where the budget allows.

    The steps are the paper's: maximal spheres give primary cameras, rays from what they miss
    vote for secondary ones, attributes follow from the covered samples. Differences, and why:

    * Samples are shot through the views' pixels, besides being spread by weight and area:
      cameras serve the picture, and a square metre that fills the picture matters more than
      one in a corner (`view_samples`, `area_samples`).
    * A sample is covered from its own side, at a usable angle, in the frustum; the paper asks
      for a free line of sight only (`coverage`).
    * A camera is judged by coverage and by how its texels compare with the view's pixels. When
      nearly all is covered the remaining cameras sharpen what is seen coarsely (`coverage`).
    * The strongest cells are only candidates; embree tells what each would really add, and the
      best is taken. Cells too near a surface are no candidates (`choose`).
    * The resolution follows from the views' pixel size, not from a count of samples (`aim`).

    Args:
        geometry: the scene; at least one triangle that cameras see and that has a weight.
        views: what the artist will look at; none means all of the scene alike.
        settings: the budget and the knobs.
        progress: is called between the steps.

    Returns:
        The placement, the same for the same input and seed.

    Raises:
        InputError: if a setting cannot be used or there is no surface to place cameras for.
    """
    settings.check()
    _check_geometry(geometry)
    rng = np.random.default_rng(settings.seed)
    progress(0.0, "Preparing the surfaces")
    frame = LocalFrame.of(geometry, tuple(views), settings.bounds)
    stage = prepare(
        frame.geometry_from_world(geometry),
        tuple(frame.view_from_world(view) for view in views),
        None if settings.bounds is None else frame.from_world(np.asarray(settings.bounds)),
        settings,
        rng,
    )
    progress(0.2, "Searching maximal spheres")
    spheres = find_spheres(
        stage.surface, stage.box, *stage.seeds, searches=settings.sphere_searches, rng=rng
    )
    stage = stage.settled_by(spheres.centre)
    progress(0.4, "Choosing primary cameras")
    quality = np.zeros(len(stage.samples))
    chosen, quality = choose_primaries(stage, spheres, quality, settings)
    progress(0.5, "Voting for secondary cameras")
    more, quality = choose_secondaries(
        stage, spheres, quality, settings, rng=rng, progress=progress
    )
    progress(0.95, "Setting the cameras' attributes")
    return _placement(stage, spheres, chosen + more, frame, settings)


def _check_geometry(geometry: SceneGeometry) -> None:
    if not len(geometry) or not geometry.camera_visible.any():
        raise InputError(
            "The scene has no surface that cameras see: add a mesh, or make one visible to "
            "the camera."
        )
    if not (geometry.weight[geometry.camera_visible] > 0.0).any():
        raise InputError(
            "Every surface has the weight 0: give a positive weight to what you will light."
        )


def _placement(
    stage: Stage,
    spheres: Spheres,
    choices: list[Choice],
    frame: LocalFrame,
    settings: PlacementSettings,
) -> Placement:
    """The chosen cameras with clips and resolution, back in the world."""
    samples = stage.samples
    quality = np.zeros(len(samples))
    cameras: list[CachingCamera] = []
    coverage: list[float] = []
    sharpness: list[float] = []
    for choice in choices:
        resolution = needed_resolution(
            choice.seen, samples.weight, settings.max_resolution, settings.max_resolution
        )
        coarser = settings.max_resolution / resolution
        quality = joined(quality, Seen(choice.seen.index, choice.seen.texel * coarser))
        camera = replace(choice.camera, id=len(cameras), resolution=resolution)
        cameras.append(_in_world(camera, stage, choice.seen, frame))
        coverage.append(float(samples.weight @ (quality > 0.0)))
        sharpness.append(float(samples.weight @ quality))
    return Placement(
        cameras=tuple(cameras),
        spheres=Spheres(frame.to_world(spheres.centre), spheres.radius * frame.unit),
        box=frame.to_world(stage.box),
        sample_point=frame.to_world(samples.point),
        sample_normal=samples.normal,
        sample_weight=samples.weight,
        from_view=samples.from_view,
        quality=quality,
        coverage=np.array(coverage),
        sharpness=np.array(sharpness),
        warnings=_warnings(stage, quality, settings),
    )


def _in_world(camera: CachingCamera, stage: Stage, seen: Seen, frame: LocalFrame) -> CachingCamera:
    """The local camera with its clips, in metres and world space."""
    corners = np.stack(np.meshgrid(*stage.geometry.bounds.T, indexing="ij"), axis=-1)
    farthest = float(np.linalg.norm(corners.reshape(-1, 3) - camera.origin, axis=-1).max())
    nearest = float(stage.surface.distance(camera.origin[None], sphere_directions(STAR))[0])
    depth: NDArray[np.float64] = camera.project(stage.samples.point[seen.index])[:, 2]
    near, far = clip_distances(depth, nearest, farthest)
    world_from_camera = camera.world_from_camera.copy()
    world_from_camera[:3, 3] = frame.to_world(camera.origin)
    return replace(
        camera, world_from_camera=world_from_camera, near=near * frame.unit, far=far * frame.unit
    )


def _warnings(
    stage: Stage, quality: NDArray[np.float64], settings: PlacementSettings
) -> tuple[str, ...]:
    """What the user should know about the result."""
    warnings = []
    samples = stage.samples
    looked_at = samples.from_view if samples.from_view.any() else np.ones(len(samples), np.bool_)
    total = samples.weight[looked_at].sum()
    if total > 0.0:
        share = float(samples.weight[looked_at] @ (quality[looked_at] > 0.0)) / float(total)
        if share < ENOUGH:
            what = "what the views see" if samples.from_view.any() else "the surface"
            warnings.append(
                f"The caching cameras cover {100.0 * share:.1f} % of {what}; allow more than "
                f"{settings.secondaries} secondary cameras to close the holes."
            )
    outside = [
        view.name or "the viewport"
        for view in stage.views
        if view.perspective and not inside_box(view.origin[None], stage.box).all()
    ]
    if outside:
        warnings.append(
            f"The box of interest leaves out the view camera {', '.join(outside)}; cameras are "
            "placed inside the box only."
        )
    return tuple(warnings)
