# SPDX-License-Identifier: GPL-3.0-or-later
"""Traced shadows against Cycles: each kind of light, and lamps that touch what they light."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from . import test_against_cycles
from .test_against_cycles import CASES, DIFFUSE, build, compare, cycles_picture, relit_picture

blend = test_against_cycles.blend
pytestmark = pytest.mark.usefixtures("gpu_context")

# A lamp half sunk into the floor, and one into the top of the ball.
SUNK: dict[str, tuple[str, dict[str, Any], tuple[float, float, float]]] = {
    "point in the floor": ("POINT", {"energy": 200.0, "shadow_soft_size": 0.5}, (1.4, -0.8, 0.2)),
    "ball in the floor": (
        "POINT",
        {"energy": 200.0, "shadow_soft_size": 0.5, "use_soft_falloff": False},
        (1.4, -0.8, 0.6),
    ),
    "wide spot in the ball": (
        "SPOT", {"energy": 200.0, "shadow_soft_size": 0.4, "spot_size": 2.8}, (0.0, -0.2, 1.8),
    ),
}  # fmt: skip


def is_hard(kind: str, settings: dict[str, Any]) -> bool:
    return not (kind == "AREA" or settings.get("shadow_soft_size") or settings.get("angle"))


@pytest.mark.parametrize("name", CASES)
def test_each_light(name: str, blend: Any, tmp_path: Path) -> None:
    kind, settings = CASES[name]
    build(blend, kind, settings, DIFFUSE)
    hard = is_hard(kind, settings)
    ratio, psnr = compare(blend, DIFFUSE, tmp_path / "cycles.exr", hard, traced=True)
    # Half a per cent; 32 points of a light and 64 samples of Cycles are what is left. Maps reach
    # the same where a shadow's edge is soft, and 16 dB less where texels draw a hard one.
    assert ratio == pytest.approx(1.0, abs=0.005)
    # A single pixel of a hard edge that falls on the other side of its centre is worth 48 dB.
    assert psnr > 47.0, f"{psnr:.1f} dB"


@pytest.mark.parametrize("name", SUNK)
def test_lamps_that_touch(name: str, blend: Any, tmp_path: Path) -> None:
    kind, settings, place = SUNK[name]
    build(blend, kind, settings, DIFFUSE)
    blend.objects["Light"].location = place
    reference = cycles_picture(blend, tmp_path / "cycles.exr", 256)[..., :3]
    # Near a lamp 1 / t^2 is steep: 32 points leave 38 dB, 128 leave 60 dB against 1,024 samples.
    relit, hit = relit_picture(blend, DIFFUSE, 128, traced=True)
    error = ((relit - reference)[hit] / reference.max()) ** 2
    assert relit[hit].mean() == pytest.approx(reference[hit].mean(), rel=0.01)
    # Maps, whose turned disks all receivers share, have 29 to 35 dB here.
    assert -10.0 * np.log10(error.mean()) > 50.0


@pytest.mark.parametrize("offset", [0.1, 0.0, 0.5])
@pytest.mark.parametrize("name", ["point", "sun", "area"])
def test_terminator_of_a_coarse_ball(name: str, offset: float, blend: Any, tmp_path: Path) -> None:
    import bpy

    kind, settings = CASES[name]
    build(blend, kind, settings, DIFFUSE)
    lamp = blend.objects["Light"]
    # From the side, so that the terminator is in view.
    lamp.location, lamp.rotation_euler = (4.0, 1.0, 1.8), (1.3, 0.0, 1.2)
    ball = blend.objects["Icosphere"]
    bpy.ops.object.select_all(action="DESELECT")
    mesh = ball.data
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.7, location=(0, 0, 1))
    coarse = bpy.context.object
    coarse.data.shade_smooth()
    coarse.data.materials.append(mesh.materials[0])
    coarse.shadow_terminator_geometry_offset = offset
    bpy.data.objects.remove(ball)
    blend.camera.data.lens = 120.0  # the ball fills half of the picture
    hard = is_hard(kind, settings)
    reference = cycles_picture(blend, tmp_path / "cycles.exr", 4 if hard else 64)[..., 0]
    relit, hit = relit_picture(blend, DIFFUSE, 1 if hard else 32, traced=True)
    # (Of a light with an extent, few points light what is nearly black.)
    least = (1e-4 if hard else 2e-3) * reference.max()
    black = [picture <= least for picture in (reference, relit[..., 0])]
    # Where facets told their own sides, or rays started on them, it would be 28 to 83 pixels.
    assert (black[0] != black[1])[hit].sum() <= (2 if hard else 15)
    assert relit[hit].mean() == pytest.approx(reference[hit].mean(), rel=0.005)


@pytest.mark.parametrize(("turned", "level"), [(0.0, 0.0), (0.4, 0.0), (0.4, 1.3)])
@pytest.mark.parametrize("name", ["point", "sun", "area"])
def test_what_lies_in_another_plane_is_black(
    name: str, turned: float, level: float, blend: Any, tmp_path: Path
) -> None:
    import bpy

    kind, settings = CASES[name]
    build(blend, kind, settings, DIFFUSE)
    floor = blend.objects["Plane"]
    for place in ((-1.6, -1.2), (2.0, 0.8)):
        bpy.ops.mesh.primitive_plane_add(size=1.3, location=(*place, 0.0))
        plate = bpy.context.object
        plate.data.materials.append(floor.data.materials[0])
        plate.rotation_euler.z = turned
    for thing in blend.objects:
        thing.location.z += level
    blend.view_layers.update()
    hard = is_hard(kind, settings)
    reference = cycles_picture(blend, tmp_path / "cycles.exr", 4 if hard else 64)[..., 0]
    relit, hit = relit_picture(blend, DIFFUSE, 1 if hard else 32, traced=True)
    pictures = (reference[hit] / reference.max(), relit[hit, 0] / reference.max())
    black, lit = [picture <= 1e-4 for picture in pictures], [p > 1e-2 for p in pictures]
    # The plates, beside what is in the ball's shadow.
    assert black[0].sum() > 200
    # A pixel whose centre is on a plate's edge.
    assert ((black[0] & lit[1]) | (lit[0] & black[1])).sum() <= 3
    assert relit[hit].mean() == pytest.approx(reference[hit].mean(), rel=0.005)


def glow_like(scene: Any, kind: str) -> None:
    """A glowing plane, or two glowing balls of other colours, over a plane and a ball."""
    import bpy

    build(scene, "POINT", {"energy": 1.0}, DIFFUSE)
    bpy.data.objects.remove(scene.objects["Light"])
    if kind == "plane":
        bpy.ops.mesh.primitive_plane_add(size=1.2, location=(1.5, -1.0, 2.0), rotation=(0.4, 0, 0))
        balls = [bpy.context.object]
    else:
        balls = []
        for place in ((1.4, -0.9, 0.9), (-1.6, 0.3, 1.6)):
            bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=0.25, location=place)
            balls.append(bpy.context.object)
    for number, ball in enumerate(balls):
        made = bpy.data.materials.new(f"glow {number}")
        tree: Any = made.node_tree
        tree.nodes.clear()
        node = tree.nodes.new("ShaderNodeEmission")
        node.inputs["Strength"].default_value = 20.0
        node.inputs["Color"].default_value = (
            (1.0, 0.6, 0.2, 1.0) if number else (0.3, 0.7, 1.0, 1.0)
        )
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        ball.data.materials.append(made)


@pytest.mark.parametrize("kind", ["plane", "balls"])
def test_glowing_objects(kind: str, blend: Any, tmp_path: Path) -> None:
    from addon.relight.lights.mesh_lights import Glow, mesh_lights
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.geometry_reader import read_geometry

    glow_like(blend, kind)
    reference = cycles_picture(blend, tmp_path / "cycles.exr", 256)[..., :3]
    geometry = with_render_depsgraph(blend, read_geometry)
    colors = {"glow 0": (0.3, 0.7, 1.0), "glow 1": (1.0, 0.6, 0.2)}
    radiance = [colors.get(name, (0.0, 0.0, 0.0)) for name in geometry.material_names]
    count = len(radiance)
    lights = mesh_lights(geometry, Glow(20.0 * np.array(radiance), np.zeros(count, dtype=bool)))
    # All pixels share their points: near a ball 128 leave 10 % here and there, 512 leave 3 %.
    relit, hit = relit_picture(blend, DIFFUSE, 512, traced=True, lights=lights)
    # Where a light itself is seen, the layer has none of its glow.
    lit = hit & (reference.max(axis=-1) < 10.0) & (relit.max(axis=-1) > 0.0)
    assert lit.mean() > 0.5
    assert relit[lit].mean() == pytest.approx(reference[lit].mean(), rel=0.01)
    error = ((relit - reference)[lit] / reference[lit].max()) ** 2
    assert -10.0 * np.log10(error.mean()) > 40.0
