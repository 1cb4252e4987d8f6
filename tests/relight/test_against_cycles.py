# SPDX-License-Identifier: GPL-3.0-or-later
"""Each kind of light against Cycles: a plane and a faceted ball, direct light only.

The scene is read from Blender, its surfaces come from the rasterizer, and both renderers look
through the pixels' centres, so nothing but the light and its shadow differs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.scene.geometry import SceneGeometry
from addon.scene.light import Light

SIZE = 64
SAMPLES = 32
R = math.radians

DIFFUSE: dict[str, Any] = {}
GLASSY = {"Base Color": (0.6, 0.3, 0.2, 1.0), "Roughness": 0.4, "IOR": 1.5}
METAL = {"Base Color": (0.9, 0.6, 0.3, 1.0), "Roughness": 0.3, "Metallic": 1.0}

UP = (1.5, -1.0, 3.0)
TURNED = (R(20), R(15), 0.0)
CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "point": ("POINT", {"energy": 500.0}),
    "point, soft": ("POINT", {"energy": 500.0, "shadow_soft_size": 0.3}),
    "point, sphere, warm, not normalized": ("POINT", {
        "energy": 500.0, "shadow_soft_size": 0.3, "use_soft_falloff": False, "normalize": False,
        "use_temperature": True, "temperature": 3000.0}),
    "spot": ("SPOT", {"energy": 500.0, "spot_size": R(70), "spot_blend": 0.3}),
    "spot, stretched": ("SPOT", {
        "energy": 500.0, "spot_size": R(50), "spot_blend": 1.0, "scale": (1, -2, 1),
        "exposure": 1.0}),
    "spot, wide": ("SPOT", {"energy": 500.0, "spot_size": R(150), "spot_blend": 0.0}),
    "sun": ("SUN", {"energy": 3.0, "angle": 0.0}),
    "sun, wide": ("SUN", {"energy": 3.0, "angle": R(10), "normalize": False}),
    "area": ("AREA", {"energy": 500.0, "size": 1.0}),
    "area, ellipse": ("AREA", {
        "energy": 500.0, "shape": "ELLIPSE", "size": 1.0, "size_y": 0.5, "scale": (1, 2, 1),
        "normalize": False}),
    "area, spread": ("AREA", {"energy": 500.0, "shape": "DISK", "size": 0.5, "spread": R(90)}),
}  # fmt: skip


@pytest.fixture
def blend() -> Iterator[Any]:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    yield bpy.context.scene
    bpy.ops.wm.read_factory_settings(use_empty=True)


def build(scene: Any, kind: str, settings: Mapping[str, Any], material: dict[str, Any]) -> None:
    import bpy

    bpy.ops.mesh.primitive_plane_add(size=12)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=0.7, location=(0, 0, 1))
    made = bpy.data.materials.new("made")
    tree: Any = made.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeBsdfPrincipled" if material else "ShaderNodeBsdfDiffuse")
    for name, value in (material or {"Color": (0.8, 0.8, 0.8, 1.0)}).items():
        node.inputs[name].default_value = value
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    for obj in bpy.data.objects:
        obj.data.materials.append(made)
    light: Any = bpy.data.lights.new("Light", kind)
    lamp: Any = bpy.data.objects.new("Light", light)
    lamp.location, lamp.rotation_euler = UP, TURNED
    if kind in ("POINT", "SPOT"):
        light.shadow_soft_size = 0.0
    for name, value in settings.items():
        setattr(lamp if name == "scale" else light, name, value)
    camera: Any = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0, -7, 4), (R(63), 0, 0)
    scene.collection.objects.link(lamp)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = SIZE


def cycles_picture(scene: Any, path: Path, samples: int) -> NDArray[np.float64]:
    """(H, W, 4), row 0 at the bottom."""
    import bpy

    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.max_bounces = 0
    cycles.samples = samples
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.light_sampling_threshold = 0.0
    cycles.pixel_filter_type, cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image: Any = bpy.data.images.load(str(path))
    width, height = image.size
    pixels = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4).astype(np.float64)


def relit_picture(
    scene: Any,
    material: dict[str, Any],
    samples: int,
    *,
    traced: bool = False,
    lights: Sequence[Light] = (),
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(H, W, 3) of some lights, or else of the scene's one, and where a surface is seen."""
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture
    from addon.relight.light_points.light_sample import light_sample
    from addon.relight.shading.shadow import Shadow
    from addon.relight.shadows.shadow_pass import ShadowPass
    from addon.relight.shadows.traced_shadow import TracedShadowPass
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.geometry_reader import read_geometry
    from addon.scene.light_reader import read_lights
    from addon.scene.view_reader import read_view
    from tests.reference.surfaces import surfaces

    from .drawing import drawn_light

    geometry, own, view = with_render_depsgraph(
        scene, lambda d: (read_geometry(d), read_lights(d), read_view(d, scene.camera))
    )
    buffer = GeometryBuffer(geometry, view.origin)
    visible = VisibleSurfacePass(buffer).draw(view)
    position = read_texture(visible.position).astype(np.float64)
    hit = position[..., 3] > 0.0
    normal = read_texture(visible.normal).astype(np.float64)[..., :3]
    seen = surfaces(position[..., :3], normal, eye=(0, 0, 0), origin=tuple(view.origin), albedo=0.8)
    seen = replace(seen, position=position, channels={**seen.channels, **_shading(SIZE, material)})
    if geometry.corner_normals is not None:
        seen.channels["normal"][hit] = _smooth_normals(
            geometry, view.origin, position[hit][:, :3], normal[hit]
        )
    shadows, rays, uploaded = ShadowPass(buffer), TracedShadowPass(geometry), seen.upload()
    receivers = position[hit][:, :3] + view.origin
    total = np.zeros((SIZE, SIZE, 3))
    for light, k in product(lights or own, range(samples)):
        sample = light_sample(light, k, samples, per_receiver=traced)
        shadow: Shadow
        if traced:
            shadow = rays.draw(uploaded, light, sample)
        else:
            shadow = shadows.draw(light, sample, geometry.bounds, receivers)
        lit = drawn_light(seen, light, [sample], shadow=shadow)
        total += lit[..., :3] / samples
    return total, hit


def _smooth_normals(
    geometry: SceneGeometry,
    eye: NDArray[np.float64],
    position: NDArray[np.float64],
    facing: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(N, 3) of what is seen from `eye` at (N, 3) places beside it, on the side of `facing`."""
    from tests.reference.shading_normal import shading_normals
    from tests.synthetic import Tracer

    start = np.broadcast_to(eye, position.shape)
    triangle, point = Tracer(geometry).hit(start, position)
    smooth = shading_normals(geometry, triangle, point)
    back = (geometry.normal[triangle] * facing).sum(axis=1) < 0.0
    return np.asarray(np.where(back[:, None], -smooth, smooth).astype(np.float32))


def _shading(size: int, material: dict[str, Any]) -> dict[str, NDArray[np.float64]]:
    """The channels of a Principled BSDF without textures."""
    if not material:
        return {}
    color = np.array(material["Base Color"][:3])
    metallic = material.get("Metallic", 0.0)
    f0 = ((1.5 - 1.0) / (1.5 + 1.0)) ** 2
    values = {
        "diffuse_color": color * (1.0 - metallic),
        "layer_f0": [f0],
        "layer_f90": [1.0],
        "specular_f0": color * metallic + f0 * (1.0 - metallic),
        "specular_f90": [1.0, 1.0, 1.0],
        "dielectric": [1.0 - metallic],
        "roughness": [material["Roughness"]],
    }
    return {
        name: np.broadcast_to(np.float32(value), (size, size, len(value))).astype(np.float64)
        for name, value in values.items()
    }


def compare(
    scene: Any, material: dict[str, Any], path: Path, hard: bool, *, traced: bool = False
) -> tuple[float, float]:
    """The median of the ratio where Cycles sees light, and the PSNR, its peak the brightest."""
    reference = cycles_picture(scene, path, 4 if hard else 64)[..., :3]
    relit, hit = relit_picture(scene, material, 1 if hard else SAMPLES, traced=traced)
    bright = hit & (reference.mean(axis=-1) > 0.05 * reference.max())
    ratio = relit.mean(axis=-1)[bright] / reference.mean(axis=-1)[bright]
    error = ((relit - reference)[hit] / reference.max()) ** 2
    return float(np.median(ratio)), float(-10.0 * np.log10(error.mean()))


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("name", CASES)
def test_diffuse(name: str, blend: Any, tmp_path: Path) -> None:
    kind, settings = CASES[name]
    build(blend, kind, settings, DIFFUSE)
    hard = not (kind == "AREA" or settings.get("shadow_soft_size") or settings.get("angle"))
    ratio, psnr = compare(blend, DIFFUSE, tmp_path / "cycles.exr", hard)
    # The half a per cent; 32 points of a light for an area light's grid, which is
    # uneven over them, and of Cycles' 64 samples the noise.
    assert ratio == pytest.approx(1.0, abs=0.01 if name == "area, spread" else 0.005)
    # Hard shadows: single pixels at the edges, each worth 36 dB; soft ones: 32 steps.
    assert psnr > 42.0, f"{psnr:.1f} dB"


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("material", [GLASSY, METAL], ids=["dielectric", "metal"])
@pytest.mark.parametrize("name", ["point", "sun, wide"])
def test_specular(name: str, material: dict[str, Any], blend: Any, tmp_path: Path) -> None:
    kind, settings = CASES[name]
    build(blend, kind, settings, material)
    lamp = blend.objects["Light"]
    lamp.location, lamp.rotation_euler = (1.5, 2.0, 3.0), (R(-35), R(10), 0.0)
    ratio, psnr = compare(blend, material, tmp_path / "cycles.exr", name == "point")
    # The tables are within 0.2 % of Cycles'; 32 points of a sun ten degrees wide, whose highlight
    # is narrower than it, are 1 % off.
    assert ratio == pytest.approx(1.0, abs=0.005 if name == "point" else 0.015)
    assert psnr > 46.0, f"{psnr:.1f} dB"
