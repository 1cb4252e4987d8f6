# SPDX-License-Identifier: GPL-3.0-or-later
"""Places caching cameras for a shot (paper section III.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import count

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..progress import Progress, part_of, silent
from ..scene.geometry import SceneGeometry
from ..scene.view import View
from .aim import clip_distances, needed_resolution
from .box import inside_box
from .budget import Budget
from .camera import CachingCamera
from .choose import Chosen, choose_cameras
from .coverage import WELL, Seen, joined
from .frame import LocalFrame
from .offer import Choice
from .placement import LeftOut, Placement, Shares
from .places import VotedPlaces, near_spheres
from .prepare import Stage, prepare
from .samples import Samples
from .settings import RESOLUTIONS, PlacementSettings
from .spheres import Spheres, find_spheres, joined_spheres
from .surface_distance import sphere_directions

# Directions in which a camera looks for the surface nearest to it.
STAR = 256
# Less of the views' pixels covered than this is worth a warning: the rest will be holes.
ENOUGH = 0.98
# Less than this share that no place sees is not told.
LEAST_TOLD = 0.005


def place_cameras(
    geometry: SceneGeometry,
    views: Sequence[View],
    settings: PlacementSettings,
    progress: Progress = silent,
    earlier: Sequence[CachingCamera] = (),
) -> Placement:
    """Choose caching cameras that see what the views see, sharply where the budget allows.

    The steps are the paper's: maximal spheres give primary cameras, rays from what they miss
    vote for secondary ones, attributes follow from the covered samples. Differences, and why:

    * Samples are shot through the pixels of the views, and of the views from a little elsewhere,
      besides being spread by weight and area: cameras serve the picture, and a square metre
      that fills the picture matters more than one in a corner (`view_samples`, `moves`).
    * A sample is seen from its own side and in the frustum, and counts half when that is at a
      glancing angle; the paper asks for a free line of sight only (`coverage`).
    * A camera is judged by what it sees and by how its texels compare with the view's pixels.
      When nearly all is seen the remaining cameras sharpen what is seen coarsely (`coverage`).
    * Spheres about places near the views are candidates beside the maximal ones: in the open a
      sphere grows far above all that there is to see, and what a view sees through leaves is
      seen best from near it (`places`).
    * The strongest cells are only candidates; embree tells what each would really add, and the
      best is taken. Cells too near a surface are no candidates (`candidates`).
    * The resolution follows from the views' pixel size, not from a count of samples (`aim`).
    * A budget of pictures, texels or megabytes may be given; it is kept exactly, and what gains
      most for what it costs comes first (`budget`, `choose`).
    * A scene that changed a little keeps most of its cameras (`keep`); the paper starts anew.

    Args:
        geometry: the scene; at least one triangle that cameras see and that has a weight.
        views: what the artist will look at; none means all of the scene alike.
        settings: the budget and the knobs.
        progress: is called between the steps.
        earlier: cameras of an earlier placement, metres and world space. Those that still earn
            their place are kept as they are, ids included, and as few others as possible are
            added; only clips are widened where the scene needs it.

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
    progress(0.4, "Letting rays vote for more cameras")
    near = near_spheres(stage)
    chosen = choose_cameras(
        stage,
        spheres,
        near,
        settings,
        VotedPlaces(stage, settings, rng),
        earlier=_groups([_as_baked(frame.camera_from_world(c), settings) for c in earlier]),
        progress=part_of(progress, 0.5, 0.95),
    )
    progress(0.95, "Setting the cameras' attributes")
    return _placement(
        stage,
        joined_spheres([spheres, near]),
        chosen,
        frame=frame,
        settings=settings,
        earlier=earlier,
    )


def _as_baked(camera: CachingCamera, settings: PlacementSettings) -> CachingCamera:
    """The camera as the bake makes it: with no more texels than the settings allow."""
    return replace(camera, resolution=min(camera.resolution, settings.max_resolution))


def _groups(cameras: Sequence[CachingCamera]) -> list[list[CachingCamera]]:
    """Perspective cameras alone, the faces of each cube together, in their order."""
    groups: dict[tuple[str, int], list[CachingCamera]] = {}
    for camera in cameras:
        alone = camera.kind == "PERSPECTIVE"
        groups.setdefault((camera.kind, camera.id if alone else camera.source), []).append(camera)
    return list(groups.values())


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
    chosen: Chosen,
    *,
    frame: LocalFrame,
    settings: PlacementSettings,
    earlier: Sequence[CachingCamera],
) -> Placement:
    """The chosen cameras with clips, ids, sources and resolutions, back in the world."""
    samples = stage.samples
    wanted = {camera.id: camera.resolution for camera in earlier}
    worth = np.zeros(len(samples))
    cameras: list[CachingCamera] = []
    seen: list[float] = []
    well_seen: list[float] = []
    kept = [choice.camera for group in chosen.groups[: chosen.kept] for choice in group]
    taken = {camera.id for camera in kept}
    free_ids = (number for number in count() if number not in taken)
    secondaries = count()
    for number, group in enumerate(chosen.groups):
        from_before = number < chosen.kept
        source = group[0].camera.source
        if group[0].camera.kind == "PERSPECTIVE":
            source = next(secondaries)
        elif from_before:
            # An earlier cube's sphere is not among those found now.
            source = len(spheres)
            spheres = _with_sphere(spheres, group[0].camera.origin, stage)
        for choice in group:
            worth = joined(worth, choice.seen)
            camera = _with_clips(choice.camera, stage, choice.seen, widen=from_before)
            resolution = camera.resolution
            # Where texels are counted, a camera gets those that were paid for.
            if Budget.of(settings).texels is None:
                resolution = (
                    wanted[camera.id] if from_before else _wanted_resolution(choice, samples)
                )
            number_of_it = camera.id if from_before else next(free_ids)
            camera = replace(camera, id=number_of_it, source=source, resolution=resolution)
            cameras.append(frame.camera_to_world(camera))
            seen.append(float(samples.weight @ (worth > 0.0)))
            well_seen.append(float(samples.weight @ (worth >= WELL)))
    return Placement(
        cameras=tuple(cameras),
        spheres=Spheres(frame.to_world(spheres.centre), spheres.radius * frame.unit),
        box=frame.to_world(stage.box),
        sample_point=frame.to_world(samples.point),
        sample_normal=samples.normal,
        sample_weight=samples.weight,
        from_view=samples.from_view,
        worth=worth,
        seen=np.array(seen),
        well_seen=np.array(well_seen),
        warnings=_warnings(stage, worth, chosen, settings),
        stop=chosen.stop,
        shares=_shares(stage, worth, chosen),
        left_out=_left_out(stage, worth, chosen),
        kept=len(kept),
    )


def _wanted_resolution(choice: Choice, samples: Samples) -> int:
    """What the camera is to have: the tier that it needs, for a finer bake later too."""
    resolution = choice.camera.resolution
    return needed_resolution(choice.seen, samples.weight, resolution, RESOLUTIONS[-1])


def _with_sphere(spheres: Spheres, centre: NDArray[np.float64], stage: Stage) -> Spheres:
    """The spheres and one more, as large as the room about `centre` (3,)."""
    radius = stage.surface.distance(centre[None], sphere_directions(STAR))
    return Spheres(
        np.concatenate([spheres.centre, centre[None]]), np.concatenate([spheres.radius, radius])
    )


def _with_clips(camera: CachingCamera, stage: Stage, seen: Seen, *, widen: bool) -> CachingCamera:
    """The local camera with its clips; those that it has are at most widened if `widen`."""
    corners = np.stack(np.meshgrid(*stage.geometry.bounds.T, indexing="ij"), axis=-1)
    farthest = float(np.linalg.norm(corners.reshape(-1, 3) - camera.origin, axis=-1).max())
    nearest = float(stage.surface.distance(camera.origin[None], sphere_directions(STAR))[0])
    depth: NDArray[np.float64] = camera.project(stage.samples.point[seen.index])[:, 2]
    near, far = clip_distances(depth, nearest, farthest)
    if widen:
        near, far = min(near, camera.near), max(far, camera.far)
    return replace(camera, near=near, far=far)


def _shares(stage: Stage, worth: NDArray[np.float64], chosen: Chosen) -> Shares:
    """Seen and well seen of the stage's samples."""
    samples = stage.samples
    seen = worth > 0.0
    well = worth >= WELL
    by_view = np.where(samples.from_view, samples.weight, 0.0)
    # Points by area are drawn by area and weight, so each stands for as much of them.
    by_area = ~samples.from_view & (stage.known_side | chosen.reached | seen)
    figures = []
    for weight in (by_view, by_area.astype(np.float64)):
        total = float(weight.sum()) or float("nan")
        figures += [float(weight @ seen) / total, float(weight @ well) / total]
    return Shares(*figures)


def _left_out(stage: Stage, worth: NDArray[np.float64], chosen: Chosen) -> LeftOut:
    """Why samples are not covered."""
    weight = np.where(worth > 0.0, 0.0, stage.samples.weight)
    reachable = float(weight @ chosen.reached)
    over_budget = reachable if chosen.stop == "budget" else 0.0
    return LeftOut(
        unreachable=float(weight @ ~chosen.reached),
        over_budget=over_budget,
        too_little=reachable - over_budget,
    )


def _warnings(
    stage: Stage, worth: NDArray[np.float64], chosen: Chosen, settings: PlacementSettings
) -> tuple[str, ...]:
    """What the user should know about the result."""
    warnings = []
    samples = stage.samples
    looked_at = samples.from_view if samples.from_view.any() else np.ones(len(samples), np.bool_)
    total = samples.weight[looked_at].sum()
    if total > 0.0:
        share = float(samples.weight[looked_at] @ (worth[looked_at] > 0.0)) / float(total)
        if share < ENOUGH:
            what = "what the views see" if samples.from_view.any() else "the surface"
            hidden = samples.weight[looked_at] @ ((worth == 0.0) & ~chosen.reached)[looked_at]
            warnings.append(
                f"The caching cameras cover {100.0 * share:.1f} % of {what}; "
                + _remedy(chosen, settings, float(hidden) / float(total))
            )
    blind = [_name(v) for v, moved in zip(stage.views, stage.moved, strict=True) if not moved]
    if blind:
        warnings.append(
            f"No surface is in sight of {', '.join(blind)}: turn it to the set, or mend its clips."
        )
    outside = [
        _name(view)
        for view in stage.views
        if view.perspective and not inside_box(view.origin[None], stage.box).all()
    ]
    if outside:
        warnings.append(
            f"The box of interest leaves out the view camera {', '.join(outside)}; cameras are "
            "placed inside the box only."
        )
    return tuple(warnings)


def _name(view: View) -> str:
    return view.name or "the viewport"


def _remedy(chosen: Chosen, settings: PlacementSettings, unreachable: float) -> str:
    """Why the rest is not covered, and what to do about it."""
    text = "no other camera would add enough to be worth its bake."
    if chosen.stop == "budget" and settings.budgeted:
        text = "allow a larger budget to close the holes."
    elif chosen.stop == "budget":
        text = f"allow more than {settings.secondaries} secondary cameras to close the holes."
    if unreachable >= LEAST_TOLD:
        text += f" No place sees {100.0 * unreachable:.1f} %."
    return text
