# SPDX-License-Identifier: GPL-3.0-or-later
"""Solo, mute, and a render pass for each light."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.light_reader import read_lights
from addon.scene.view_reader import find_camera, read_view
from addon.ui.frame_panel import lines
from addon.ui.light_passes import add_up, light_passes
from tests.ui.test_engine import baked, f12, scene  # noqa: F401 - the fixture
from tools.relit import read_scene, unmixed


def add_lamp(name: str, location: tuple[float, float, float]) -> Any:
    data = bpy.data.lights.new(name, "POINT")
    data.energy = 200.0
    lamp = bpy.data.objects.new(name, data)
    lamp.location = location
    bpy.context.scene.collection.objects.link(lamp)
    return lamp


def test_solo_and_mute_are_read(extension: None) -> None:
    lamp = add_lamp("Rim", (0.0, 3.0, 2.0))
    lamp.relume.solo = True
    bpy.data.objects["Light"].relume.mute = True
    lights = with_render_depsgraph(bpy.context.scene, read_lights)
    assert {light.name: (light.mute, light.solo) for light in lights} == {
        "Light": (True, False),
        "Rim": (False, True),
    }


def test_solo_and_mute_are_read_without_the_extension(tmp_path: Path) -> None:
    import addon

    bpy.ops.wm.read_factory_settings()
    addon.register()
    bpy.data.objects["Light"].relume.mute = True
    bpy.context.scene.relume.mute_world = True
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    addon.unregister()
    bpy.ops.wm.open_mainfile(filepath=path)
    (light,) = with_render_depsgraph(bpy.context.scene, read_lights)
    assert (light.mute, light.solo) == (True, False)
    arrays = read_scene(bpy.context.scene)
    assert (arrays.mute_world, arrays.mute_emission) == (True, False)
    # Cycles knows nothing of it.
    whole = unmixed(arrays)
    assert (whole.lights[0].mute, whole.mute_world) == (False, False)


def test_muted_lights_are_not_in_a_render(scene: Any) -> None:  # noqa: F811
    baked(scene)
    add_lamp("Rim", (0.0, 3.0, 2.0))
    both = f12(scene)[..., :3]
    bpy.data.objects["Rim"].relume.mute = True
    without = f12(scene)[..., :3]
    bpy.data.objects["Rim"].relume.mute = False
    bpy.data.objects["Rim"].relume.solo = True
    alone = f12(scene)[..., :3]
    scene.relume.mute_world = True
    bpy.data.objects["Rim"].relume.solo = False
    dark = f12(scene)[..., :3]
    world = both - dark
    assert world.max() > 0.01
    # The world goes with solo, and stays with mute.
    assert np.abs(without + alone - both).max() < 1e-5
    assert np.abs(alone - (both - without)).max() < 1e-5
    assert alone.max() > 0.01


def test_an_open_session_follows_what_the_scene_mutes(scene: Any) -> None:  # noqa: F811
    from addon.ui.scene_session import SceneSession

    baked(scene)

    def layers(graph: Any) -> set[str]:
        opened = SceneSession(graph, 1)
        opened.session.set_view(read_view(graph, find_camera(scene)))
        before = set(opened.session.render().layers)
        scene.relume.mute_world = True
        opened.follow_settings(scene)
        return before - set(opened.session.render().layers)

    assert with_render_depsgraph(scene, layers) == {"World"}


def rendered_channels(scene: Any) -> dict[str, NDArray[np.float32]]:  # noqa: F811
    """What F12 writes as a multi-layer file."""
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(scene.render.filepath, separate_channels=True) as exr:
        return {
            name: np.asarray(channel.pixels)
            for part in exr.parts
            for name, channel in part.channels.items()
        }


def test_each_light_has_a_render_pass(scene: Any, tmp_path: Path) -> None:  # noqa: F811
    baked(scene)
    add_lamp("Rim", (0.0, 3.0, 2.0))
    scene.relume.light_passes = True
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.filepath = str(tmp_path / "layers.exr")
    channels = rendered_channels(scene)
    passes = {"Light Light", "Light Rim", "Light of World"}
    found = {name.split(".")[-2] for name in channels}
    assert passes <= found
    layer = scene.view_layers[0].name
    total = sum(channels[f"{layer}.{name}.G"] for name in passes)
    combined = channels[f"{layer}.Combined.G"]
    # Sums of float32 numbers of order one, in another order.
    assert np.abs(total - combined).max() < 1e-5
    assert channels[f"{layer}.Light Rim.G"].max() > 0.01


def test_passes_of_a_picture_without_any_light(scene: Any, tmp_path: Path) -> None:  # noqa: F811
    baked(scene)
    bpy.data.objects["Light"].relume.mute = True
    scene.relume.mute_world = True
    scene.relume.light_passes = True
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.filepath = str(tmp_path / "layers.exr")
    channels = rendered_channels(scene)
    light = [pixels for name, pixels in channels.items() if ".Light Light." in name]
    assert len(light) == 3
    assert not any(pixels.any() for pixels in light)


def test_each_view_layer_has_its_own_picture(scene: Any, tmp_path: Path) -> None:  # noqa: F811
    scene.world = None
    bpy.data.objects["Light"].hide_render = True
    scene.view_layers[0].name = "Red"
    scene.view_layers.new("Green")
    for name, color in (("Red", (1.0, 0.0, 0.0)), ("Green", (0.0, 1.0, 0.0))):
        lamp = add_lamp(name, (0.0, 3.0, 2.0))
        lamp.data.color = color
        made = bpy.data.collections.new(name)
        scene.collection.children.link(made)
        scene.collection.objects.unlink(lamp)
        made.objects.link(lamp)
    for layer in scene.view_layers:
        other = "Green" if layer.name == "Red" else "Red"
        layer.layer_collection.children[other].exclude = True
    baked(scene)
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.filepath = str(tmp_path / "layers.exr")
    channels = rendered_channels(scene)
    lit = {name: bool(channels[name].any()) for name in channels if name[-1] in "RG"}
    assert lit == {
        "Red.Combined.R": True,
        "Red.Combined.G": False,
        "Green.Combined.R": False,
        "Green.Combined.G": True,
    }


def test_names_of_passes_fit_and_differ(extension: None) -> None:
    long = "Ä" * 31
    for name in (long, long + "b", "World"):
        add_lamp(name, (0.0, 0.0, 3.0))
    passes = light_passes(bpy.context.scene)
    assert set(passes) >= {"Light", "World", "World (scene)", "Emission"}
    assert len(set(passes.values())) == len(passes)
    assert all(len(name.encode()) <= 63 for name in passes.values())


def test_instances_are_in_their_lights_pass() -> None:
    ones = np.ones((1, 1, 3), dtype=np.float32)
    layers = {"Bulb": ones, "Post/Bulb": 2 * ones, "Post/Bulb #2": 4 * ones, "World": 8 * ones}
    layers |= {"Screen": 16 * ones, "Emission": 32 * ones}
    passes = {"Bulb": "Light Bulb", "World": "Light of World", "Emission": "Light of Surfaces"}
    sums = add_up((1, 1), layers, passes, ("Screen",))
    assert {name: float(pixels[0, 0, 0]) for name, pixels in sums.items()} == {
        "Light Bulb": 7.0,
        "Light of World": 8.0,
        "Light of Surfaces": 48.0,
    }


@pytest.mark.usefixtures("extension")
def test_the_panel_lists_every_pass() -> None:
    from addon.relight.graph.frame_graph import FrameGraph
    from addon.relight.graph.frame_passes import LightNode, frame_passes

    graph = FrameGraph(frame_passes([LightNode("Key", True, False)], has_emission=False))
    graph.ran("Light Key", 0.0123, last=True)
    rows = {text: (icon, took) for icon, text, took in lines(graph)}
    assert rows["Light Key"] == ("CHECKMARK", "12.3 ms")
    assert rows["World"] == ("RADIOBUT_ON", "")
    assert len(rows) == len(graph.passes)
