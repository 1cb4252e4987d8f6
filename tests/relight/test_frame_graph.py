# SPDX-License-Identifier: GPL-3.0-or-later
"""What an edit makes dirty, and nothing else."""

from __future__ import annotations

import pytest

from addon.relight.graph.frame_graph import FrameGraph, FramePass
from addon.relight.graph.frame_passes import LightNode, frame_passes, light_input

KEY = LightNode("Key", casts=True, follows_view=False)
SUN = LightNode("Sun", casts=True, follows_view=True)
FILL = LightNode("Fill", casts=False, follows_view=False)

EVERY_VIEW = {"Visible surface", "Correspondence map", "Surfaces"}
EDITS = {
    "view": EVERY_VIEW
    | {"Light Key", "Shadows of Sun", "Light Sun", "Light Fill", "World", "Emission", "Picture"},
    "world": {"World", "Picture"},
    light_input("Key", "color"): {"Picture"},
    light_input("Key", "shape"): {"Light Key", "Picture"},
    light_input("Key", "shadow casting"): {"Shadows of Key", "Light Key", "Picture"},
    light_input("Fill", "shadow casting"): set(),
    "surface edits": {
        "Light Key", "Light Sun", "Light Fill", "World", "Emission", "Picture",
    },
    "cache": {
        "Correspondence map", "Surfaces", "Light Key", "Light Sun", "Light Fill", "World",
        "Emission", "Picture",
    },
}  # fmt: skip


def clean_graph(*lights: LightNode) -> FrameGraph:
    graph = FrameGraph(frame_passes(lights, has_emission=True))
    for each in graph.passes:
        graph.clean(each.name)
    return graph


@pytest.mark.parametrize("edited", EDITS)
def test_an_edit_makes_dirty_what_depends_on_it(edited: str) -> None:
    graph = clean_graph(KEY, SUN, FILL)
    dirty = graph.touch(edited)
    assert set(dirty) == EDITS[edited]
    assert {each.name for each in graph.passes if graph.is_dirty(each.name)} == EDITS[edited]
    order = [each.name for each in graph.passes]
    assert sorted(dirty, key=order.index) == list(dirty)


def test_what_was_dirty_stays_so() -> None:
    graph = clean_graph(KEY, FILL)
    graph.touch(light_input("Key", "shape"))
    graph.touch("world")
    assert graph.is_dirty("Light Key")
    assert graph.is_dirty("World")


def test_geometry_makes_all_dirty() -> None:
    graph = clean_graph(KEY, SUN)
    assert set(graph.touch("geometry")) == {each.name for each in graph.passes}


def test_a_new_light_leaves_the_others_alone() -> None:
    graph = clean_graph(KEY)
    dirty = graph.replace(frame_passes((KEY, FILL), has_emission=True))
    assert set(dirty) == {"Light Fill", "Picture"}
    graph.clean("Light Fill")
    assert graph.replace(frame_passes((FILL,), has_emission=True)) == ("Picture",)
    assert not graph.is_dirty("Light Fill")


def test_a_light_that_stops_casting_is_drawn_again() -> None:
    graph = clean_graph(KEY)
    other = LightNode("Key", casts=False, follows_view=False)
    assert set(graph.replace(frame_passes((other,), has_emission=True))) == {
        "Light Key",
        "Picture",
    }


def test_inputs_are_what_nobody_makes() -> None:
    graph = clean_graph(FILL)
    assert graph.inputs == (
        "geometry", "view", "cache", "surface edits", "Fill: shape", "samples", "world",
        "Fill: color",
    )  # fmt: skip


def test_it_draws_itself() -> None:
    chart = FrameGraph([FramePass("A", ("in",), ("made",)), FramePass("B", ("made",), ("out",))])
    assert chart.mermaid().splitlines() == [
        "flowchart LR",
        '  i0(["in"])',
        '  p0["A"]',
        '  p1["B"]',
        "  i0 --> p0",
        '  p0 -- "made" --> p1',
    ]


@pytest.mark.parametrize(
    ("passes", "message"),
    [
        ([FramePass("A", ("late",), ("x",)), FramePass("B", (), ("late",))], "A reads late"),
        ([FramePass("A", ("x",), ("x",))], "A reads x"),
        ([FramePass("A", (), ("x",)), FramePass("B", (), ("x",))], "A and B both make x"),
        ([FramePass("A", (), ("x",)), FramePass("A", (), ("y",))], "one name"),
    ],
)
def test_graphs_that_cannot_run_are_refused(passes: list[FramePass], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        FrameGraph(passes)
