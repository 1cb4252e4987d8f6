# SPDX-License-Identifier: GPL-3.0-or-later
"""What linking and object weights mean, and how they are read; pictures are compared with Cycles'
in tests/relight/test_linking_against_cycles.py."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.scene.light import Light
from addon.scene.light_linking import (
    UNLINKED,
    LightLinking,
    LinkedObjects,
    ObjectSelection,
    ObjectWeight,
    beyond_cycles,
    blockers,
    cycles_receivers,
    receiver_weights,
)
from tests.synthetic import box, geometry_of

GEOMETRY = replace(
    geometry_of([box((x, 0, 0), 1.0) for x in range(4)]),
    full_names=(("", "A"), ("", "B"), ("Group", "A"), ("Group", "C")),
)


@pytest.mark.parametrize(
    ("linked", "want"),
    [
        (LinkedObjects(), "1111"),
        (LinkedObjects(frozenset("A")), "1010"),
        (LinkedObjects(excluded=frozenset("AC")), "0100"),
        (LinkedObjects(frozenset("AB"), frozenset("B")), "1010"),
        (LinkedObjects(frozenset({"Group"}), named=frozenset({"Group"})), "0011"),
        # Who is named anywhere counts before what it instances.
        (LinkedObjects(frozenset("A"), named=frozenset({"Group"})), "1000"),
        (LinkedObjects(excluded=frozenset("A"), named=frozenset({"Group"})), "0111"),
    ],
)
def test_who_is_linked(linked: LinkedObjects, want: str) -> None:
    flags = np.array([int(flag) for flag in want])
    np.testing.assert_array_equal(blockers(LightLinking(blockers=linked), GEOMETRY), flags)
    weights = receiver_weights(LightLinking(receivers=linked), GEOMETRY)
    np.testing.assert_array_equal(weights, np.stack([flags, flags], axis=1))
    assert blockers(LightLinking(receivers=linked), GEOMETRY).all()
    assert (receiver_weights(LightLinking(blockers=linked), GEOMETRY) == 1.0).all()


def test_weights() -> None:
    selection = ObjectSelection(
        (ObjectWeight("A", 0.5, 2.0), ObjectWeight("Group", 3.0, 0.0)), 0.25
    )
    linking = LightLinking(LinkedObjects(excluded=frozenset("B")), None, selection)
    want = [(0.5, 2.0), (0.0, 0.0), (3.0, 0.0), (3.0, 0.0)]
    np.testing.assert_array_equal(receiver_weights(linking, GEOMETRY), want)
    lone = LightLinking(selection=ObjectSelection((), 0.25))
    assert (receiver_weights(lone, GEOMETRY) == 0.25).all()


def test_names_of_arrays_that_were_not_read() -> None:
    bare = replace(GEOMETRY, full_names=())
    linking = LightLinking(LinkedObjects(frozenset(["part 2"])))
    np.testing.assert_array_equal(receiver_weights(linking, bare)[:, 0], [0, 0, 1, 0])


def dark(*names: str) -> tuple[ObjectWeight, ...]:
    return tuple(ObjectWeight(name, 0.0, 0.0) for name in names)


@pytest.mark.parametrize(
    ("own", "selection", "beyond"),
    [
        (None, ObjectSelection(), 0),
        (None, ObjectSelection((ObjectWeight("A"),)), 0),
        (None, ObjectSelection(dark("A")), 0),
        (None, ObjectSelection((ObjectWeight("A"), *dark("B")), 0.0), 0),
        (None, ObjectSelection(dark("A"), 0.0), 0),
        (None, ObjectSelection((), 0.0), 0),
        (LinkedObjects(frozenset("AB")), ObjectSelection(dark("A")), 0),
        (LinkedObjects(frozenset("AB")), ObjectSelection(dark("A", "B")), 0),
        (LinkedObjects(frozenset("A")), ObjectSelection((ObjectWeight("B"),), 0.0), 0),
        (LinkedObjects(frozenset("AB")), ObjectSelection((ObjectWeight("B"),), 0.0), 0),
        (LinkedObjects(frozenset(), frozenset("C")), ObjectSelection(dark("A")), 0),
        (LinkedObjects(frozenset(), frozenset("A")), ObjectSelection((ObjectWeight("A"),), 0.0), 0),
        (None, ObjectSelection((ObjectWeight("A", 1.0, 0.0), ObjectWeight("B")), 0.0), 1),
        (None, ObjectSelection((ObjectWeight("A", 0.5, 0.5),), 2.0), 2),
    ],
)
def test_what_cycles_shows(
    own: LinkedObjects | None, selection: ObjectSelection, beyond: int
) -> None:
    """The written collection lights what gets any light; and shows what nothing is said about."""
    assert len(beyond_cycles(selection)) == beyond
    plain = replace(GEOMETRY, full_names=tuple(("", name) for name in "ABCD"))
    want = receiver_weights(LightLinking(own, None, selection), plain)
    written = cycles_receivers(own, selection, "Lamp")
    got = receiver_weights(LightLinking(written or own), plain)
    if beyond:
        want = np.broadcast_to(want.any(axis=1, keepdims=True), want.shape)
    np.testing.assert_array_equal(got, want)
    if written is not None:
        assert not written.included & written.excluded


@pytest.fixture
def scene() -> Iterator[Any]:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    for name in "ABCD":
        mesh: Any = bpy.data.meshes.new(name)
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, mesh))
    for name in ("Key", "Fill"):
        lamp = bpy.data.objects.new(name, bpy.data.lights.new(name, "POINT"))
        bpy.context.scene.collection.objects.link(lamp)
    yield bpy.context.scene
    bpy.ops.wm.read_factory_settings(use_empty=True)


def read(scene: Any) -> dict[str, Light]:
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.light_reader import read_lights

    return {light.name: light for light in with_render_depsgraph(scene, read_lights)}


def collection(name: str, objects: str, excluded: str = "") -> Any:
    import bpy

    made = bpy.data.collections.new(name)
    for each in objects:
        made.objects.link(bpy.data.objects[each])
    for each, link in zip(objects, made.collection_objects, strict=True):
        link.light_linking.link_state = "EXCLUDE" if each in excluded else "INCLUDE"
    return made


def test_collections_as_read(scene: Any) -> None:
    """A child's state is that of all within it, and what comes later wins."""
    inner = collection("inner", "AB", excluded="A")
    outer = collection("outer", "BC")
    outer.children.link(inner)
    outer.collection_children[0].light_linking.link_state = "EXCLUDE"
    scene.objects["Key"].light_linking.receiver_collection = outer
    scene.objects["Fill"].light_linking.blocker_collection = collection("shade", "D")
    lights = read(scene)
    assert lights["Key"].linking == LightLinking(
        LinkedObjects(frozenset("BC"), frozenset("A"), frozenset("ABC"))
    )
    shade = LinkedObjects(frozenset("D"), frozenset(), frozenset("D"))
    assert lights["Fill"].linking == LightLinking(None, shade)
    assert not lights["Key"].warnings + lights["Fill"].warnings


def test_hidden_emitters_name_objects_too(scene: Any) -> None:
    scene.objects["Key"].light_linking.receiver_collection = collection("some", "A")
    scene.objects["B"].light_linking.receiver_collection = collection("others", "C")
    receivers = read(scene)["Key"].linking.receivers
    assert receivers is not None
    assert receivers.named == frozenset("AC")


def test_empty_collection_links_nothing(scene: Any) -> None:
    """Cycles lights all objects by it (see tests/relight/test_linking_against_cycles.py)."""
    scene.objects["Key"].light_linking.receiver_collection = collection("none", "")
    assert read(scene)["Key"].linking is UNLINKED


def test_names_of_instances(scene: Any) -> None:
    import bpy

    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.geometry_reader import read_geometry

    held = collection("held", "A")
    scene.collection.objects.unlink(scene.objects["A"])
    group: Any = bpy.data.objects.new("Group", None)
    group.instance_type, group.instance_collection = "COLLECTION", held
    scene.collection.objects.link(group)
    geometry = with_render_depsgraph(scene, read_geometry)
    assert set(geometry.full_names) == {("Group", "A"), ("", "B"), ("", "C"), ("", "D")}
    assert [own for _, own in geometry.full_names] == list(geometry.object_names)


def test_a_link_makes_no_cache_stale(scene: Any) -> None:
    """Linking is a light's: what is baked does not depend on it."""
    from addon.caching.fingerprint import scene_fingerprint
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.geometry_reader import read_geometry

    before = scene_fingerprint(with_render_depsgraph(scene, read_geometry))
    linking = scene.objects["Key"].light_linking
    linking.receiver_collection = collection("some", "AB", excluded="B")
    linking.blocker_collection = collection("shade", "CD")
    assert read(scene)["Key"].linking != UNLINKED
    assert scene_fingerprint(with_render_depsgraph(scene, read_geometry)) == before
