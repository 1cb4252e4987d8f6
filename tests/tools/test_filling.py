# SPDX-License-Identifier: GPL-3.0-or-later
"""What happens at the end to the pictures that fill a view's holes."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from addon.camplace.hole_cameras import HoleCameras
from addon.progress import Cancelled
from tests import synthetic
from tools.filling import Filling
from tools.verbs import arguments


@pytest.fixture
def done(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, list[int]]]:
    """What the store was told."""
    told: list[tuple[str, list[int]]] = []
    store = SimpleNamespace(
        keep=lambda numbers: told.append(("keep", numbers)),
        discard=lambda numbers: told.append(("discard", numbers)),
        read=list,
    )
    monkeypatch.setattr(Filling, "_temporary", store)
    found = HoleCameras((synthetic.cube_cameras((0.0, 0.0, 0.0), 64)[0],), 1.5, 0.25)
    monkeypatch.setattr("tools.filling.hole_cameras", lambda *_: found)
    monkeypatch.setattr("tools.filling.CacheStore", SimpleNamespace(open=lambda _: None))
    monkeypatch.setattr("addon.hole_bake.bake_holes", lambda *_, **__: [7])
    return told


def _filling(*, keeps: bool) -> Filling:
    session: Any = SimpleNamespace(
        set_view=lambda _: None, hole_points=lambda **_: None, set_added=lambda _: None
    )
    arrays: Any = SimpleNamespace(geometry=None)
    return Filling(None, arrays, Path("cache"), session, fills=True, keeps=keeps)


@pytest.mark.parametrize(("keeps", "what"), [(False, "discard"), (True, "keep")])
@pytest.mark.parametrize("error", [None, Cancelled, KeyboardInterrupt, ValueError])
def test_pictures_are_kept_or_go_whatever_happens_later(
    done: list[tuple[str, list[int]]], keeps: bool, what: str, error: type[BaseException] | None
) -> None:
    view: Any = SimpleNamespace(name="Camera")
    raised = None
    try:
        with _filling(keeps=keeps) as filling:
            filling.fill(view, lambda *_: None)
            if error is not None:
                raise error
    except (Cancelled, KeyboardInterrupt, ValueError) as caught:
        raised = type(caught)
    assert raised is error
    assert done == [(what, [7])]


@pytest.mark.usefixtures("done")
def test_pictures_of_one_run_stay_together_and_what_is_left_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    numbers = iter(range(10))
    given: list[list[int]] = []

    def bake(*_: Any, together: Sequence[int]) -> tuple[int, ...]:
        given.append(list(together))
        return next(numbers), next(numbers)

    monkeypatch.setattr("addon.hole_bake.bake_holes", bake)
    with _filling(keeps=True) as filling:
        for name in ("Left", "Right"):
            view: Any = SimpleNamespace(name=name)
            filling.fill(view, lambda *_: None)
    assert given == [[], [0, 1]]
    assert [note.partition(":")[0] for note in filling.notes] == ["camera 'Left'", "camera 'Right'"]
    assert all("25.00 % of what the cache lacks" in note for note in filling.notes)


@pytest.mark.parametrize(
    ("given", "fills", "sharpens"),
    [
        ([], False, False),
        (["--fill-holes"], True, False),
        (["--keep-filled"], True, False),
        (["--sharpen"], True, True),
    ],
)
@pytest.mark.usefixtures("done")
def test_what_is_soft_is_asked_for_with_sharpen_alone(
    given: list[str], fills: bool, sharpens: bool
) -> None:
    parser = argparse.ArgumentParser()
    arguments.add_filling(parser)
    asked = []
    session: Any = SimpleNamespace(
        set_view=lambda _: None,
        hole_points=lambda *, and_soft: asked.append(and_soft),
        set_added=lambda _: None,
    )
    arrays: Any = SimpleNamespace(geometry=None)
    chosen = arguments.filling(parser.parse_args(given))
    view: Any = SimpleNamespace(name="Camera")
    Filling(None, arrays, Path("cache"), session, **chosen).fill(view, lambda *_: None)
    assert asked == ([sharpens] if fills else [])
