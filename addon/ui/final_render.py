# SPDX-License-Identifier: GPL-3.0-or-later
"""A final picture, made in the render's thread but for what draws: that is the interface's."""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import TYPE_CHECKING, Any

from ..progress import Progress
from ..scene.exposure_reader import ReadAt
from ..scene.render_region import RenderRegion
from ..scene.view import View
from .hole_render import fill_for_render
from .main_thread import MainThread, let_go
from .scene_session import SceneSession

if TYPE_CHECKING:
    from types import TracebackType

    from ..relight.layers.picture import Picture

# For so long the interface draws a picture before it looks after its windows again, in seconds; one
# sample of one light may take longer.
_STRETCH_S = 0.05


class FinalRender:
    """The session of one final picture; the end of its `with` block frees what it has on the GPU.

    Args:
        main: does what draws.
        depsgraph: of the render.
        view: that is rendered.

    Raises:
        InputError: there is no cache that can be shown.
        Cancelled: the render was.
    """

    def __init__(self, main: MainThread, depsgraph: Any, view: View) -> None:
        self._main = main
        self._view = view
        self._picture: Picture | None = None
        samples = depsgraph.scene.relume.render_samples
        self._opened: SceneSession | None = main.do(lambda: SceneSession(depsgraph, samples))
        try:
            main.do(lambda: self.opened.session.set_view(view))
        except BaseException:
            main.finish(self._close)
            raise

    @property
    def opened(self) -> SceneSession:
        """The scene with its cache."""
        if self._opened is None:
            raise RuntimeError("the picture is finished")
        return self._opened

    def fill_holes(self, scene: Any, progress: Progress) -> str:
        """See `fill_for_render`; `scene` is the original one."""
        return fill_for_render(scene, self.opened, self._view, progress, self._main)

    def expose(self, scene: Any, camera: Any, read_at: ReadAt, region: RenderRegion | None) -> None:
        """Blur what moves while the shutter is open; see `read_exposure`."""
        exposure = self.opened.read_exposure(scene, camera, self._view, read_at, region=region)
        self._main.do(lambda: self.opened.set_exposure(exposure))

    def render(self, progress: Progress) -> Picture:
        """The picture. Raises Cancelled, as `progress` does."""
        steps = self._main.do(self.opened.session.rendering)
        while (told := self._main.do(lambda: self._advance(steps))) is not None:
            progress(*told)
        assert self._picture is not None
        return self._picture

    def describe(self) -> str:
        """See `SceneSession.describe`."""
        return self._main.do(self.opened.describe)

    def __enter__(self) -> FinalRender:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        # What was at work holds the session too, which is freed where it was made.
        let_go(error)
        self._main.finish(self._close)

    def _advance(
        self, steps: Generator[tuple[float, str], None, Picture]
    ) -> tuple[float, str] | None:
        """Draw for a stretch of time; how far it is, None at the end."""
        started = time.perf_counter()
        while True:
            try:
                told = next(steps)
            except StopIteration as end:
                self._picture = end.value
                return None
            if time.perf_counter() - started >= _STRETCH_S:
                return told

    def _close(self) -> None:
        self._opened = None
