# SPDX-License-Identifier: GPL-3.0-or-later
"""What the pictures of viewports leave out or approximate, as the panel lists it.

A panel is drawn many times a second and must not open a session: viewports, which have one open,
say here what it warns of.
"""

from __future__ import annotations

import weakref
from pathlib import Path
from typing import TYPE_CHECKING

from .camera_watch import redraw
from .event_loop import call_later

if TYPE_CHECKING:
    from .progressive_picture import PictureTimes
    from .scene_session import SceneSession

_viewports: weakref.WeakSet[ViewportWarnings] = weakref.WeakSet()


class ViewportWarnings:
    """Those of one viewport; they end with it."""

    def __init__(self) -> None:
        # A session frees the GPU's memory with its last reference, which is not to be this one.
        self._session: weakref.ref[SceneSession] | None = None
        self._times: PictureTimes | None = None
        self._was_finished = False
        self._warnings: tuple[str, ...] = ()
        self._said: tuple[Path | None, tuple[str, ...]] = (None, ())
        _viewports.add(self)

    def follow(
        self, opened: SceneSession, times: PictureTimes, note: str, *, is_finished: bool
    ) -> None:
        """To be called at each drawing of a view that stands still.

        Args:
            opened: what is drawn.
            times: of the picture: other ones when the view or the scene changed.
            note: a sentence beside the session's own, or "".
            is_finished: whether the picture has all its samples.
        """
        if times.full is not None and self._is_news(opened, times, is_finished):
            self._warnings = opened.warnings
        self._say(opened.folder, (*self._warnings, note) if note else self._warnings)

    def forget(self) -> None:
        """No session is open any more."""
        self._session, self._warnings = None, ()
        self._say(None, ())

    def sentences(self, folder: Path) -> tuple[str, ...]:
        """What it said of the cache in this folder."""
        return self._said[1] if self._said[0] == folder else ()

    def _is_news(self, opened: SceneSession, times: PictureTimes, is_finished: bool) -> bool:
        """Whether the session was not asked yet of this picture since it is whole, or finished: to
        ask it for each sample would take long in scenes of many triangles."""
        before = (None if self._session is None else self._session(), self._times)
        is_same = before[0] is opened and before[1] is times
        if is_same and self._was_finished == is_finished:
            return False
        self._session, self._times = weakref.ref(opened), times
        self._was_finished = is_finished
        return True

    def _say(self, folder: Path | None, sentences: tuple[str, ...]) -> None:
        if (folder, sentences) != self._said:
            self._said = folder, sentences
            call_later(_redraw_panel, 0.0)


def viewport_warnings(folder: Path) -> tuple[str, ...]:
    """A sentence for each thing that viewports which show the cache in this folder warn of."""
    said = [sentence for each in _viewports for sentence in each.sentences(folder)]
    return tuple(dict.fromkeys(said))


def _redraw_panel() -> None:
    redraw({"PROPERTIES"})
