# SPDX-License-Identifier: GPL-3.0-or-later
"""Alpha-blended and tinted panes before a wall and a floor, and their shadows, against Cycles:
baked, relit and rendered."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix
from numpy.typing import NDArray

from addon.caching.bake import BakeSettings, bake_scene
from addon.caching.store import CacheStore
from addon.camplace.camera import CachingCamera
from addon.relight.session import RelightSession
from addon.relight.shadows.shadow_frustum import ShadowMethod, ShadowSettings
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from addon.scene.light_reader import read_lights
from addon.scene.view_reader import read_view
from addon.scene.world_reader import read_world

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 64
Shader = Callable[[Any], Any]
R = np.radians


def node(tree: Any, kind: str, **inputs: Any) -> Any:
    made = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in inputs.items():
        made.inputs[name.replace("_", " ")].default_value = value
    return made


def mixed(tree: Any, factor: Any, first: Any, second: Any) -> Any:
    mix = tree.nodes.new("ShaderNodeMixShader")
    if isinstance(factor, float):
        mix.inputs[0].default_value = factor
    else:
        tree.links.new(factor, mix.inputs[0])
    for number, shader in ((1, first), (2, second)):
        tree.links.new(shader.outputs[0], mix.inputs[number])
    return mix


def material(name: str, shader: Shader) -> Any:
    made = bpy.data.materials.new(name)
    tree: Any = made.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(shader(tree).outputs[0], output.inputs["Surface"])
    return made


def diffuse(tree: Any, *color: float) -> Any:
    return node(tree, "BsdfDiffuse", Color=(*color, 1.0))


def half_there(tree: Any, opacity: float, tint: tuple[float, ...] = (1.0, 1.0, 1.0)) -> Any:
    clear = node(tree, "BsdfTransparent", Color=(*tint, 1.0))
    return mixed(tree, opacity, clear, diffuse(tree, 0.9, 0.3, 0.2))


def image(values: Callable[[Any, Any], Any]) -> Any:
    """Values from 0 to 1 of x and y, both from 0 to 1."""
    side = 32
    made = bpy.data.images.new("mask", side, side)
    made.colorspace_settings.name = "Non-Color"
    y, x = np.mgrid[0:side, 0:side] / (side - 1)
    pixels = np.ones((side, side, 4), dtype=np.float32)
    pixels[..., :3] = values(x, y)[..., None]
    made.pixels.foreach_set(pixels.ravel())
    made.pack()
    return made


def masked(tree: Any, values: Callable[[Any, Any], Any]) -> Any:
    picture = tree.nodes.new("ShaderNodeTexImage")
    picture.image, picture.extension = image(values), "EXTEND"
    clear = node(tree, "BsdfTransparent")
    return mixed(tree, picture.outputs[0], clear, diffuse(tree, 0.2, 0.8, 0.3))


def leaf(x: Any, y: Any) -> Any:
    return ((x - 0.5) ** 2 + (y - 0.5) ** 2 < 0.16).astype(np.float32)


def glowing(tree: Any) -> Any:
    """What adds to what lies behind, and takes nothing from it."""
    added = tree.nodes.new("ShaderNodeAddShader")
    glow = node(tree, "Emission", Color=(0.1, 0.2, 0.4, 1.0), Strength=0.5)
    tree.links.new(node(tree, "BsdfTransparent").outputs[0], added.inputs[0])
    tree.links.new(glow.outputs[0], added.inputs[1])
    return added


ONE = (0.0, 0.0)
# Shaders of panes, each with its place, x and y; and the least PSNR over the picture, in decibels:
# about 3 below what 32 samples have, whose noise is in it.
PANES: dict[str, tuple[list[tuple[Shader, tuple[float, float]]], float]] = {
    "alpha 0.3": ([(partial(half_there, opacity=0.3), ONE)], 50.0),
    "three tinted panes": (
        [
            (partial(half_there, opacity=0.4, tint=(0.9, 0.3, 0.2)), (-0.4, 0.0)),
            (partial(half_there, opacity=0.4, tint=(0.3, 0.9, 0.3)), (0.0, 0.4)),
            (partial(half_there, opacity=0.4, tint=(0.2, 0.4, 0.95)), (0.4, 0.8)),
        ],
        46.0,
    ),
    "gradient": ([(partial(masked, values=lambda x, y: 0.5 * (x + y)), ONE)], 47.0),
    "Principled alpha": (
        [(lambda t: node(t, "BsdfPrincipled", Alpha=0.6, Roughness=0.3), ONE)],
        50.0,
    ),
    "added glow": ([(glowing, ONE)], 50.0),
    "leaf": ([(partial(masked, values=leaf), ONE)], 41.0),
}


def build(panes: list[tuple[Shader, tuple[float, float]]], light: str = "AREA") -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene: Any = bpy.context.scene
    upright = (R(90), 0.0, 0.0)
    add_plane(material("floor", lambda t: diffuse(t, 0.7, 0.6, 0.5)), 10.0, (0, 0, 0))
    add_plane(material("wall", lambda t: diffuse(t, 0.4, 0.6, 0.8)), 10.0, (0, 2, 0), upright)
    for number, (shader, (x, y)) in enumerate(panes):
        add_plane(material(f"pane {number}", shader), 1.5, (x, y, 1), upright)
    data: Any = bpy.data.lights.new("Key", light)
    data.energy = 200.0
    if light == "AREA":
        data.size = 0.5
    else:
        data.shadow_soft_size = 0.0
    lamp = bpy.data.objects.new("Key", data)
    lamp.location, lamp.rotation_euler = (1.2, -2.5, 3.5), (R(40), 0.0, R(25))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.6, -5.0, 2.2), (R(75), 0.0, R(6))
    for obj in (lamp, camera):
        scene.collection.objects.link(obj)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    return scene


def add_plane(
    made: Any, size: float, place: tuple[float, ...], turned: tuple[float, ...] = (0.0, 0.0, 0.0)
) -> None:
    bpy.ops.mesh.primitive_plane_add(size=size, location=place, rotation=turned)
    obj: Any = bpy.context.object
    obj.data.materials.append(made)


def caching_cameras(scene: Any, resolution: int = 320) -> list[CachingCamera]:
    """One at the view and two beside it."""
    bpy.context.view_layer.update()
    places = [scene.camera.matrix_world]
    for location, rotation in (((-2, -4, 1.8), (80, 0, -24)), ((0, -3, 3.2), (60, 0, 0))):
        turned = Euler([R(angle) for angle in rotation]).to_matrix().to_4x4()
        places.append(Matrix.Translation(location) @ turned)
    return [
        CachingCamera(
            number, np.array(place, dtype=np.float64), 1.3, 0.05, 100.0, resolution,
            "PERSPECTIVE", number,
        )
        for number, place in enumerate(places)
    ]  # fmt: skip


def relit(
    scene: Any,
    folder: Path,
    samples: int,
    visibility: int,
    method: ShadowMethod = "traced",
) -> RelightSession:
    """A session that is ready to render."""
    geometry = with_render_depsgraph(scene, read_geometry)
    bake_scene(scene, geometry, caching_cameras(scene), folder, BakeSettings(preset="draft"))
    geometry, lights, view, world = with_render_depsgraph(
        scene,
        lambda d: (read_geometry(d), read_lights(d), read_view(d, scene.camera), read_world(d)),
    )
    shadows = ShadowSettings(method=method)
    session = RelightSession(
        geometry, CacheStore.open(folder), samples, shadows, visibility=visibility
    )
    session.set_lights(lights)
    session.set_world(world)
    session.set_view(view)
    return session


def cycles(scene: Any, path: Path, samples: int) -> NDArray[np.float64]:
    """(H, W, 4), row 0 at the bottom."""
    scene.render.engine = "CYCLES"
    settings: Any = scene.cycles
    settings.samples, settings.max_bounces = samples, 0
    settings.use_adaptive_sampling = settings.use_denoising = False
    settings.sample_clamp_direct = settings.light_sampling_threshold = 0.0
    settings.transparent_max_bounces = 64
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    picture: Any = bpy.data.images.load(str(path))
    pixels = np.empty(SIZE * SIZE * 4, dtype=np.float32)
    picture.pixels.foreach_get(pixels)
    return pixels.reshape(SIZE, SIZE, 4).astype(np.float64)


def psnr(one: NDArray[Any], other: NDArray[Any]) -> float:
    """Of display-encoded values, decibels."""
    encoded = [np.clip(np.maximum(each, 0.0) ** (1.0 / 2.2), 0.0, 1.0) for each in (one, other)]
    return float(-10.0 * np.log10(((encoded[0] - encoded[1]) ** 2).mean()))


@pytest.mark.parametrize("name", PANES)
def test_panes_and_their_shadows(name: str, tmp_path: Path) -> None:
    panes, least = PANES[name]
    scene = build(panes)
    picture = relit(scene, tmp_path / "cache", 32, 64).render().combined
    reference = cycles(scene, tmp_path / "cycles.exr", 256)
    assert psnr(picture[..., :3], reference[..., :3]) > least
    # Half a per cent, as of opaque surfaces.
    means = [each[..., :3].mean(axis=(0, 1)) for each in (picture, reference)]
    assert means[0] == pytest.approx(means[1], rel=5e-3)


def test_one_sample_without_lists(tmp_path: Path) -> None:
    """The first picture of a view has all layers too, blended."""
    panes, _ = PANES["three tinted panes"]
    scene = build(panes, "POINT")
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    picture = relit(scene, tmp_path / "cache", 1, 0).render().combined
    reference = cycles(scene, tmp_path / "cycles.exr", 16)
    # Hard shadows and pixels' centres: but for texels at edges nothing differs.
    assert psnr(picture[..., :3], reference[..., :3]) > 52.0


def test_lists_are_the_mean_of_pictures(tmp_path: Path) -> None:
    """Shading samples with weights in colours against a picture for each sample, to what sharing
    costs at edges."""
    panes, _ = PANES["three tinted panes"]
    scene = build(panes, "POINT")
    brute = relit(scene, tmp_path / "cache", 16, 0)
    brute.set_world(None)
    listed = relit(scene, tmp_path / "cache", 16, 16)
    listed.set_world(None)
    one, other = brute.render().combined, listed.render().combined
    assert psnr(one[..., :3], other[..., :3]) > 44.0
    # Where a pixel sees the same surfaces all over, both are the same.
    equal = np.abs(one - other).max(axis=-1) < 1e-4 * one.max()
    assert equal.mean() > 0.8


def test_alpha_of_a_transparent_film(tmp_path: Path) -> None:
    """What panes before nothing cover: alpha is one less the mean of what they let through."""
    scene = build([(partial(half_there, opacity=0.4, tint=(0.9, 0.3, 0.2)), ONE)])
    bpy.data.objects.remove(bpy.data.objects["Plane.001"])  # the wall
    scene.render.film_transparent = True
    scene.camera.location, scene.camera.rotation_euler = (0.0, -5.0, 1.2), (R(95), 0.0, 0.0)
    reference = cycles(scene, tmp_path / "cycles.exr", 256)[..., 3]
    covered = 1.0 - 0.6 * np.mean([0.9, 0.3, 0.2])
    # Cycles' samples go through or don't.
    inside = np.abs(reference - covered) < 0.15
    assert inside.mean() > 0.02
    assert reference[inside].mean() == pytest.approx(covered, abs=0.01)
    for visibility in (0, 32):
        picture = relit(scene, tmp_path / "cache", 32, visibility).render().combined
        # The noise of 256 samples inside, and of the filter at the outlines.
        assert np.abs(picture[..., 3] - reference).mean() < 5e-3
        assert np.median(picture[..., 3][inside]) == pytest.approx(covered, abs=1e-5)


@pytest.mark.parametrize("method", ["map"])
def test_shadow_maps_dim_by_dithering(method: ShadowMethod, tmp_path: Path) -> None:
    scene = build(PANES["alpha 0.3"][0])
    picture = relit(scene, tmp_path / "cache", 32, 16, method).render().combined
    reference = cycles(scene, tmp_path / "cycles.exr", 128)
    # As many texels as light is stopped, to the noise of 32 maps.
    assert psnr(picture[..., :3], reference[..., :3]) > 44.0
    means = [each[..., :3].mean() for each in (picture, reference)]
    assert means[0] == pytest.approx(means[1], rel=2e-3)
