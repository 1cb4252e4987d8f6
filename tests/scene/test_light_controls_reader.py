# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights' controls and images as read from Blender."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.image_reader import read_image
from addon.scene.light import Light
from addon.scene.light_controls import MOST_BLOCKERS, NEUTRAL, Superellipse
from addon.scene.light_reader import read_lights
from addon.ui import light_properties


@pytest.fixture
def lamp() -> Iterator[Any]:
    """A point light in an empty scene, with Relume's controls."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    light_properties.register()
    obj = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    bpy.context.scene.collection.objects.link(obj)
    yield obj
    light_properties.unregister()
    bpy.ops.wm.read_factory_settings(use_empty=True)


def read() -> Light:
    bpy.context.view_layer.update()
    (light,) = with_render_depsgraph(bpy.context.scene, read_lights)
    return light


def test_neutral_by_default(lamp: Any) -> None:
    light = read()
    assert light.controls == NEUTRAL
    assert not light.warnings


def test_neutral_where_the_properties_are_not_registered(lamp: Any) -> None:
    lamp.data.relume.diffuse = 0.5
    light_properties.unregister()
    assert read().controls == NEUTRAL


def test_every_control(lamp: Any) -> None:
    c = lamp.data.relume
    doors = c.barn_doors
    doors.use, doors.width, doors.height, doors.width_edge = True, 0.5, 0.25, 0.125
    doors.roundness, doors.shear, doors.rotation, doors.density = 2.0, (0.5, -1.0), 0.25, 0.75
    doors.invert = True
    c.distance.use_far, c.distance.far, c.distance.far_edge = True, 4.0, 2.0
    c.distance.near = 3.0
    c.falloff.use, c.falloff.exponent, c.falloff.distance = True, 1.0, 2.0
    c.noise.use, c.noise.amount, c.noise.offset, c.noise.projected = True, 0.5, (1, 2, 3), False
    c.shadow.color, c.shadow.softness, c.shadow.offset = (0.5, 0.25, 0.0), 2.0, (0, 1, 0)
    c.shadow.hide_highlights, c.shadow.density = False, 0.5
    c.diffuse, c.specular, c.ambient = 0.5, 0.25, 0.125
    controls = read().controls
    assert controls.barn_doors is not None
    assert controls.barn_doors.outline == Superellipse(0.5, 0.25, 0.125, 0.0, 2.0)
    assert controls.barn_doors.shear == (0.5, -1.0)
    assert (controls.barn_doors.rotation, controls.barn_doors.density) == (0.25, 0.75)
    assert controls.barn_doors.invert
    assert controls.distance is not None
    assert (controls.distance.near, controls.distance.far) == (0.0, 4.0)
    assert controls.distance.far_edge == 2.0
    assert controls.falloff is not None
    assert (controls.falloff.exponent, controls.falloff.distance) == (1.0, 2.0)
    assert controls.noise is not None
    assert (controls.noise.amount, controls.noise.offset) == (0.5, (1.0, 2.0, 3.0))
    assert not controls.noise.projected
    shadow = controls.shadow
    assert (shadow.color, shadow.density, shadow.softness) == ((0.5, 0.25, 0.0), 0.5, 2.0)
    assert (shadow.offset, shadow.hide_highlights) == ((0.0, 1.0, 0.0), False)
    assert (controls.diffuse, controls.specular, controls.ambient) == (0.5, 0.25, 0.125)


def test_an_animated_control_is_read_at_its_frame(lamp: Any) -> None:
    noise = lamp.data.relume.noise
    noise.use = True
    for frame, x in ((1, 0.0), (11, 10.0)):
        noise.offset[0] = x
        lamp.data.keyframe_insert("relume.noise.offset", index=0, frame=frame)
    bpy.context.scene.frame_set(6)
    controls = read().controls
    assert controls.noise is not None
    assert controls.noise.offset[0] == pytest.approx(5.0)


def card(name: str, *, linked: bool = True) -> Any:
    obj = bpy.data.objects.new(name, None)
    if linked:
        bpy.context.scene.collection.objects.link(obj)
    return obj


def test_blockers_are_where_their_objects_are(lamp: Any) -> None:
    parent, child = card("Stand"), card("Flag")
    child.parent, child.location, parent.location = parent, (0, 0, 1), (1, 2, 3)
    child.hide_viewport = False
    item = lamp.data.relume.blockers.add()
    item.object, item.width, item.color, item.invert = child, 0.5, (1.0, 0.0, 0.5), True
    lamp.data.relume.blockers.add()
    off = lamp.data.relume.blockers.add()
    off.object, off.use = parent, False
    (blocker,) = read().controls.blockers
    assert blocker.name == "Flag"
    np.testing.assert_allclose(blocker.world_from_blocker[:3, 3], (1, 2, 4))
    assert blocker.outline.width == 0.5
    assert (blocker.color, blocker.invert) == ((1.0, 0.0, 0.5), True)
    parent.location = (5, 2, 3)
    (blocker,) = read().controls.blockers
    np.testing.assert_allclose(blocker.world_from_blocker[:3, 3], (5, 2, 4))
    # One that nobody sees is still a place.
    collection = bpy.data.collections.new("Hidden")
    bpy.context.scene.collection.children.link(collection)
    item.object = card("Nowhere", linked=False)
    collection.objects.link(item.object)
    item.object.location = (7, 8, 9)
    item.object.hide_render = item.object.hide_viewport = True
    (blocker,) = read().controls.blockers
    np.testing.assert_allclose(blocker.world_from_blocker[:3, 3], (7, 8, 9))
    collection.hide_render = collection.hide_viewport = True
    item.object.location = (7, 8, 10)
    (blocker,) = read().controls.blockers
    np.testing.assert_allclose(blocker.world_from_blocker[:3, 3], (7, 8, 10))


def test_what_is_not_shown_is_said(lamp: Any) -> None:
    c = lamp.data.relume
    c.blockers.add().object = card("Nowhere", linked=False)
    for number in range(MOST_BLOCKERS + 1):
        c.blockers.add().object = card(f"Card {number}")
    c.slide.use = True
    c.slide.image = bpy.data.images.new("Lost", 2, 2)
    c.slide.image.filepath, c.slide.image.source = "/nowhere/lost.png", "FILE"
    light = read()
    assert len(light.controls.blockers) == MOST_BLOCKERS
    assert light.controls.slide is None
    for words in ("'Nowhere' is in no collection", "first 32 of its 33", "'Lost' has no pixels"):
        assert any(words in text for text in light.warnings), light.warnings
    bpy.data.lights["Lamp"].type = "SUN"
    bpy.data.lights["Lamp"].relume.falloff.use = True
    light = read()
    assert light.controls.falloff is None
    assert any("sun" in text for text in light.warnings)


def test_a_slide_is_scene_linear(lamp: Any) -> None:
    image = bpy.data.images.new("Bytes", 2, 1)
    image.pixels = [0.0, 128 / 255, 1.0, 1.0, 10 / 255, 0.0, 0.0, 0.0]
    slide = lamp.data.relume.slide
    slide.use, slide.image, slide.kind, slide.scale = True, image, "SLIDE", (2.0, 3.0)
    read_slide = read().controls.slide
    assert read_slide is not None
    # IEC 61966-2-1, by hand: (128/255 + 0.055) / 1.055 to the 2.4, and 10/255 / 12.92.
    np.testing.assert_allclose(
        read_slide.pixels, [[[0.0, 0.2158605, 1.0, 1.0], [0.003035, 0.0, 0.0, 0.0]]], atol=1e-6
    )
    assert (read_slide.image, read_slide.use, read_slide.scale) == ("Bytes", "SLIDE", (2.0, 3.0))
    plain = bpy.data.images.new("Plain", 1, 1, is_data=True)
    plain.pixels = [128 / 255] * 4
    slide.image = plain
    again = read().controls.slide
    assert again is not None
    assert again.pixels[0, 0, 1] == pytest.approx(128 / 255)


def test_images_are_read_again_when_they_change(lamp: Any, tmp_path: Path) -> None:
    problems: list[str] = []
    image = bpy.data.images.new("Painted", 2, 2, float_buffer=True)
    image.pixels = [0.25, 0.5, 1.0, 0.5] * 4
    first = read_image(image, problems)
    assert first is not None
    # Float pixels are kept multiplied with their alpha.
    np.testing.assert_allclose(first[0, 0], (0.5, 1.0, 2.0, 0.5))
    image.pixels[0] = 0.0
    second = read_image(image, problems)
    assert second is not None
    assert second[0, 0, 0] == 0.0
    image.filepath_raw, image.file_format = str(tmp_path / "a.png"), "PNG"
    image.save()
    saved = bpy.data.images.load(str(tmp_path / "a.png"))
    third = read_image(saved, problems)
    assert third is not None
    assert read_image(saved, problems) is third, "an unchanged file is read once"
    saved.alpha_mode = "NONE"
    opaque = read_image(saved, problems)
    assert opaque is not None
    assert (opaque[..., 3] == 1.0).all()
    assert not problems
    strange = bpy.data.images.new("Strange", 2, 2)
    strange.colorspace_settings.name = "ACEScct"
    read_image(strange, problems)
    assert "ACEScct" in problems[0]
