# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine: F12 and the viewport's Rendered shading."""

from __future__ import annotations

import math
import traceback
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ..errors import InputError
from ..progress import Cancelled
from ..scene.render_region import RenderRegion
from ..scene.view import View
from ..scene.view_reader import find_camera, read_render_region, read_view
from . import compatible_panels
from .light_passes import Pixels, add_up, light_passes
from .main_thread import MainThread
from .unbaked_picture import draw_unbaked
from .viewport import Viewport

if TYPE_CHECKING:
    from .final_render import FinalRender

ENGINE = "RELUME"


class RelumeEngine(bpy.types.RenderEngine):
    """Relights the scene from its cache."""

    bl_idname = ENGINE
    bl_label = "Relume"
    # With an interface, its thread draws (`main_thread`): a GPU context of the render's own would
    # keep all windows from being drawn until it ends. Without one there is no other.
    bl_use_gpu_context = bpy.app.background
    bl_use_eevee_viewport = True  # Material Preview shading stays EEVEE's
    bl_use_postprocess = True
    bl_use_preview = False
    # Otherwise there is no Shader Editor.
    bl_use_shading_nodes_custom = False

    _viewport: Viewport | None = None

    def render(self, depsgraph: Any) -> None:
        """A final picture of the scene's camera; F12."""
        scene = depsgraph.scene
        try:
            view = read_view(depsgraph, find_camera(scene))
            region = read_render_region(scene.render, view)
            view = view if region is None else region.of(view)
        except InputError as error:
            self._refuse(error)
            return
        with MainThread(self.test_break) as main:
            passes = self._passes(main, depsgraph, view, region)
        if passes is None:
            return
        if region is not None:
            passes = {name: region.cut(pixels) for name, pixels in passes.items()}
        self._deliver(depsgraph, passes)

    def _passes(
        self, main: MainThread, depsgraph: Any, view: View, region: RenderRegion | None
    ) -> dict[str, Pixels] | None:
        """The relit picture, or the scene's shapes where there is none; None when cancelled."""
        try:
            try:
                return self._relight(main, depsgraph, view, region)
            except InputError as error:
                self._refuse(error)
                return {"Combined": main.do(lambda: draw_unbaked(depsgraph, view))}
        except Cancelled:
            return None
        except Exception as error:  # noqa: BLE001 - Blender crashes where one leaves a render
            traceback.print_exc()
            self._refuse(error)
            return None

    def update_render_passes(self, scene: Any = None, renderlayer: Any = None) -> None:
        """Tell the compositor which passes there are."""
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        if scene is not None and scene.relume.light_passes:
            for name in light_passes(scene).values():
                self.register_pass(scene, renderlayer, name, 3, "RGB", "COLOR")

    def _relight(
        self, main: MainThread, depsgraph: Any, view: View, region: RenderRegion | None
    ) -> dict[str, Pixels]:
        """Every pass, (H, W, channels) float32, scene-linear, row 0 at the bottom."""
        # Imported late: it takes scipy along, which would slow down every start of Blender.
        from .final_render import FinalRender

        self.update_stats("", "Relume: loading the cache")
        with FinalRender(main, depsgraph, view) as final:
            if depsgraph.scene.relume.fill_holes:
                unfilled = final.fill_holes(depsgraph.scene.original, self._progress)
                if unfilled:
                    self.report({"WARNING"}, f"Relume: {unfilled}")
            self._expose(depsgraph, final, region)
            picture = final.render(self._progress)
            self.update_stats("", f"Relume: {final.describe()}")
            for sentence in final.opened.stale:
                self.report({"WARNING"}, f"Relume: {sentence}")
            for warning in final.opened.warnings:
                self.report({"INFO"}, f"Relume: {warning}")
        passes = {"Combined": picture.combined}
        if depsgraph.scene.relume.light_passes:
            height, width = picture.combined.shape[:2]
            names = light_passes(depsgraph.scene)
            passes |= add_up((height, width), picture.layers, names, picture.glowing)
        return passes

    def _expose(self, depsgraph: Any, final: FinalRender, region: RenderRegion | None) -> None:
        """Blur what moves while the shutter is open."""
        scene = depsgraph.scene
        if not scene.render.use_motion_blur:
            return

        def read_at(frame: float, read: Callable[[Any], Any]) -> Any:
            whole = math.floor(frame)
            self.frame_set(whole, frame - whole)
            return read(depsgraph)

        frame, part = scene.frame_current, scene.frame_subframe
        try:
            final.expose(scene, find_camera(scene), read_at, region)
        finally:
            self.frame_set(frame, part)

    def _progress(self, fraction: float, message: str) -> None:
        if self.test_break():
            raise Cancelled
        self.update_progress(fraction)
        self.update_stats("", f"Relume: {message}")

    def _refuse(self, error: Exception) -> None:
        """Say why there is no relit picture."""
        self.update_stats("", f"Relume: {error}")
        self.report({"ERROR"}, f"Relume: {error}")

    def _deliver(self, depsgraph: Any, passes: Mapping[str, Pixels]) -> None:
        """Hand a view layer's picture, or its render region, to Blender."""
        height, width = passes["Combined"].shape[:2]
        # Blender counts from the region's corner, not from the picture's.
        result = self.begin_result(0, 0, width, height, layer=depsgraph.view_layer.name)
        try:
            for layer in result.layers:
                for name, pixels in passes.items():
                    target = layer.passes.get(name)
                    if target is not None:
                        target.rect.foreach_set(pixels.astype(np.float32).ravel())
        finally:
            # Whatever happens, Blender gets its result back.
            self.end_result(result)

    def view_update(self, context: Any, depsgraph: Any) -> None:  # noqa: ARG002
        """The scene changed; also the first call of a viewport."""
        if self._viewport is None:
            self._viewport = Viewport()
        self._viewport.note_changes(depsgraph)

    def view_draw(self, context: Any, depsgraph: Any) -> None:
        """Draw the viewport."""
        if self._viewport is None:
            self._viewport = Viewport()
        if self._viewport.draw(self, context, depsgraph):
            self.tag_redraw()


def register() -> None:
    bpy.utils.register_class(RelumeEngine)
    compatible_panels.register(ENGINE)


def unregister() -> None:
    compatible_panels.unregister(ENGINE)
    bpy.utils.unregister_class(RelumeEngine)
