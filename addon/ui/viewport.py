# SPDX-License-Identifier: GPL-3.0-or-later
"""What one 3D viewport shows under Rendered shading."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gpu
from gpu_extras.presets import draw_texture_2d

from ..errors import InputError
from ..glsl.shader import texture_from_array
from ..scene.view import View, same_view
from ..scene.view_reader import read_viewport, viewport_lens
from . import job, shown_graph
from .cache_folder import cache_folder
from .cache_stamp import cache_stamp
from .heat_map import HeatMap
from .hole_filler import HoleFiller
from .progressive_picture import ProgressivePicture, in_words
from .properties import picture_seconds
from .scene_changes import NOTHING, SceneChanges, read_changes, scene_key, world_key
from .unbaked_picture import draw_unbaked
from .viewport_warnings import ViewportWarnings

if TYPE_CHECKING:
    import bpy

    from .scene_session import SceneSession

LOADING = "loading the cache"


class Viewport:
    """Keeps a session for one viewport, refines its picture and draws it.

    Blender reports changes while no GPU context is sure to be there, so they are noted, and
    worked off at the next drawing.
    """

    def __init__(self) -> None:
        self._opened: SceneSession | None = None
        self._error = ""
        self._failed_stamp = -1
        self._announced = False
        self._changes: SceneChanges = NOTHING
        self._key = 0
        self._world_key: tuple[int, bool] | None = None
        self._key_is_old = True
        self._unbaked_view: View | None = None
        self._picture = ProgressivePicture()
        self._filler = HoleFiller()
        self._heat_map = HeatMap()
        self._warnings = ViewportWarnings()

    def note_changes(self, depsgraph: Any) -> None:
        """Remember what the last evaluation of the scene changed."""
        self._changes = self._changes | read_changes(depsgraph)
        self._key_is_old = True
        self._unbaked_view = None

    def draw(self, engine: bpy.types.RenderEngine, context: Any, depsgraph: Any) -> bool:
        """Bring the picture a little further and draw it; True while it is not finished."""
        scene = depsgraph.scene
        lens = viewport_lens(depsgraph, context.space_data, context.region_data)
        view = read_viewport(context.region, context.region_data, scene, lens)
        try:
            self._synchronize(depsgraph)
        except InputError as error:
            self._fail(str(error))
        if self._opened is None:
            # While another bake is loaded, the picture from the last one stays.
            if not self._announced or self._picture.texture is None:
                self._draw_unbaked(depsgraph, view)
            unfinished = self._announced
            self._warnings.forget()
            engine.update_stats("Relume", self._error)
        else:
            target = scene.relume.viewport_samples
            self._opened.session.set_samples(target)
            self._opened.follow_settings(scene)
            if self._opened.follow_filled():
                self._picture.note_change()
                self._heat_map.forget()
            unfinished = self._refine(self._opened, view, picture_seconds(scene))
            is_whole = not self._picture.is_moving and self._picture.divisor == 1
            self._filler.follow(scene.original, self._opened, view, is_whole=is_whole)
            if scene.relume.show_confidence and is_whole:
                self._heat_map.update(self._opened.session, view)
            if not self._picture.is_moving:
                self._warnings.follow(
                    self._opened,
                    self._picture.times,
                    self._filler.note,
                    is_finished=not unfinished,
                )
            engine.update_stats("Relume", self._status(self._opened, target))
        self._show(engine, scene, view)
        if self._opened is not None and scene.relume.show_confidence:
            self._heat_map.draw(view)
        return unfinished

    def _synchronize(self, depsgraph: Any) -> None:
        """Open the session, or tell it what changed."""
        stamp = cache_stamp(cache_folder(depsgraph.scene))
        changes, self._changes = self._changes, NOTHING
        if self._key_is_old:
            key, self._key_is_old = scene_key(depsgraph), False
            if key != self._key:
                changes = changes | SceneChanges(geometry=True, lights=True)
            self._key = key
            world = world_key(depsgraph)
            if world != self._world_key:
                changes = changes | SceneChanges(world=True)
            self._world_key = world
        # A bake under way writes the manifest camera by camera; the last one is waited for.
        if self._opened is not None and self._opened.stamp != stamp and job.current() is None:
            self._opened = None
        if self._opened is None:
            # The same cache is not tried again before something changes.
            if stamp == self._failed_stamp and not changes:
                return
            # Reading a cache takes seconds, which the artist should know before they begin.
            if stamp != 0 and not self._announced:
                self._announced, self._changes, self._error = True, changes, LOADING
                return
            # Imported late: it takes scipy along, which would slow down every start of Blender.
            from .scene_session import SceneSession

            self._announced = False
            self._failed_stamp = stamp
            self._heat_map.forget()
            self._opened = SceneSession(depsgraph, depsgraph.scene.relume.viewport_samples)
        elif changes:
            self._picture.note_change()
            self._filler.note_change(changes)
            self._heat_map.forget()
            self._opened.update(depsgraph, changes)
            if self._opened.is_left:
                from .scene_session import SceneSession

                self._opened = None
                self._opened = SceneSession(depsgraph, depsgraph.scene.relume.viewport_samples)
        self._error = ""

    def _fail(self, message: str) -> None:
        self._opened = None
        self._error = message

    def _refine(self, opened: SceneSession, view: View, budget_s: float) -> bool:
        """Draw samples for a moment; True while more are wanted."""
        unfinished = self._picture.refine(opened.session, view, budget_s)
        shown_graph.show(opened.session.graph, self._picture.times)
        return unfinished

    def _draw_unbaked(self, depsgraph: Any, view: View) -> None:
        if self._unbaked_view is None or not same_view(view, self._unbaked_view):
            pixels = draw_unbaked(depsgraph, view)
            self._picture.replace(texture_from_array(pixels, "RGBA16F"))
            self._unbaked_view = view

    def _status(self, opened: SceneSession, target: int) -> str:
        if opened.session.compiling:
            return f"compiling the shader {opened.session.compiling}"
        if self._picture.is_moving:
            # What the cache lacks is counted pixel by pixel, for which there is no time now.
            divisor = self._picture.divisor
            return "moving" if divisor == 1 else f"moving, 1/{divisor} resolution"
        times = self._picture.times
        text = f"sample {opened.session.samples_done}/{target}"
        if times.first is not None:
            text += f", first picture after {in_words(times.first)}"
        if times.last is not None:
            text += f", last after {in_words(times.last)}"
        return "; ".join(part for part in (text, opened.describe(), self._filler.status) if part)

    def _show(self, engine: bpy.types.RenderEngine, scene: Any, view: View) -> None:
        """Draw the picture, scene-linear: Blender applies the scene's view transform."""
        texture = self._picture.texture
        if texture is None:
            return
        gpu.state.blend_set("ALPHA_PREMULT")
        engine.bind_display_space_shader(scene)
        draw_texture_2d(texture, (0, 0), view.width, view.height)
        engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")
