# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking and shadow linking against Cycles: a floor, four balls, two of them instances.

As in test_against_cycles.py both renderers look through the pixels' centres at the same triangles.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.scene.geometry import SceneGeometry

from .test_against_cycles import cycles_picture

SIZE = 96
# Of the surface that glows in one of the tests, W/(m2 sr), and the points that stand for it.
GLOW = 20.0
GLOW_POINTS = 64
BALLS = {"Left": (-1.8, 0.0, 0.7), "Middle": (-0.6, -0.3, 0.7), "Inside": (0.6, 0.0, 0.7)}


@pytest.fixture
def scene() -> Iterator[Any]:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    build(bpy.context.scene)
    yield bpy.context.scene
    bpy.ops.wm.read_factory_settings(use_empty=True)


def build(scene: Any) -> None:
    """Balls "Left" and "Middle", an instance "Group" of "Inside" and an instance "Child" by
    vertices of "Parent", over a "Floor"; two hard point lights, "Key" and "Fill"."""
    import bpy

    white: Any = bpy.data.materials.new("white")
    white.node_tree.nodes.clear()
    shader = white.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
    output = white.node_tree.nodes.new("ShaderNodeOutputMaterial")
    white.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    bpy.ops.mesh.primitive_plane_add(size=12)
    bpy.context.object.name = "Floor"
    for name, place in BALLS.items():
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=0.5, location=place)
        bpy.context.object.name = name
        bpy.ops.object.shade_smooth()
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=0.5)
    bpy.ops.object.shade_smooth()
    bpy.context.object.name = "Child"
    for obj in list(scene.objects):
        obj.data.materials.append(white)
    inside, child = scene.objects["Inside"], scene.objects["Child"]
    held = bpy.data.collections.new("Held")
    scene.collection.objects.unlink(inside)
    held.objects.link(inside)
    group: Any = bpy.data.objects.new("Group", None)
    group.instance_type, group.instance_collection = "COLLECTION", held
    mesh: Any = bpy.data.meshes.new("Parent")
    mesh.from_pydata([(0.0, 0.0, 0.0)], [], [])
    parent: Any = bpy.data.objects.new("Parent", mesh)
    parent.location, parent.instance_type = (1.8, 0.0, 0.7), "VERTS"
    child.parent = parent
    lamps = []
    for name, place, energy in (
        ("Key", (1.5, -3.0, 4.0), 500.0),
        ("Fill", (-2.0, 2.0, 3.0), 300.0),
    ):
        light: Any = bpy.data.lights.new(name, "POINT")
        light.energy, light.shadow_soft_size = energy, 0.0
        lamp = bpy.data.objects.new(name, light)
        lamp.location = place
        lamps.append(lamp)
    camera: Any = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0, -7, 4), (math.radians(62), 0, 0)
    for obj in (group, parent, *lamps, camera):
        scene.collection.objects.link(obj)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = SIZE


def collection(*objects: str, exclude: Sequence[str] = (), **children: tuple[Any, str]) -> Any:
    """A collection of objects, some of them excluded, and of collections with their states."""
    import bpy

    made = bpy.data.collections.new("linked")
    for name in objects:
        made.objects.link(bpy.data.objects[name])
    for name, link in zip(made.objects.keys(), made.collection_objects, strict=True):
        if name in exclude:
            link.light_linking.link_state = "EXCLUDE"
    for child, state in children.values():
        made.children.link(child)
        made.collection_children[-1].light_linking.link_state = state
    return made


def link(scene: Any, lamp: str, receivers: Any = None, blockers: Any = None) -> None:
    linking = scene.objects[lamp].light_linking
    linking.receiver_collection, linking.blocker_collection = receivers, blockers


def nested(scene: Any) -> None:
    """A child collection's state is that of all within it; an object's own comes after."""
    import bpy

    deep = collection("Left", exclude=["Left"])
    child = collection("Middle", "Parent", inner=(deep, "EXCLUDE"))
    link(scene, "Key", collection("Floor", "Middle", child=(child, "INCLUDE")))
    shade = bpy.data.collections.new("shade")
    shade.children.link(collection("Left", "Middle"))
    shade.collection_children[0].light_linking.link_state = "EXCLUDE"
    shade.objects.link(scene.objects["Left"])
    link(scene, "Fill", None, shade)


def instancer_is_named_elsewhere(scene: Any) -> None:
    """The fill names "Group", so that to the key, too, it is "Group", and not "Inside"."""
    link(scene, "Key", collection("Inside", "Floor"))
    link(scene, "Fill", collection("Group", exclude=["Group"]))


def without_shadow(scene: Any) -> None:
    """ "Middle" becomes a coarse ball that casts no shadow, and the floor casts none."""
    import bpy

    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=1, radius=0.5)
    bpy.ops.object.shade_smooth()
    coarse: Any = bpy.context.object
    coarse.data.materials.append(bpy.data.materials["white"])
    scene.objects["Middle"].data = coarse.data
    bpy.data.objects.remove(coarse)
    scene.objects["Middle"].visible_shadow = False
    scene.objects["Floor"].visible_shadow = False


CASES: dict[str, Callable[[Any], None]] = {
    "no linking": lambda scene: None,
    "receivers": lambda scene: link(scene, "Key", collection("Left", "Floor")),
    "no receivers": lambda scene: link(scene, "Key", collection()),
    "receivers, excluded": lambda scene: link(
        scene, "Key", collection("Left", "Parent", exclude=["Left", "Parent"])
    ),
    "a light that receives itself alone": lambda scene: link(scene, "Key", collection("Key")),
    "receivers, both": lambda scene: link(
        scene, "Key", collection("Left", "Middle", "Floor", exclude=["Middle"])
    ),
    "blockers": lambda scene: link(scene, "Key", None, collection("Middle", "Group")),
    "blockers, excluded": lambda scene: link(
        scene,
        "Key",
        None,
        collection("Middle", "Child", "Floor", exclude=["Middle", "Child", "Floor"]),
    ),
    "receivers and blockers": lambda scene: link(
        scene, "Fill", collection("Floor"), collection("Left", exclude=["Left"])
    ),
    "nested": nested,
    "an instanced object": lambda scene: link(scene, "Key", collection("Inside", "Child")),
    "an instancer": lambda scene: link(scene, "Key", collection("Group", "Parent")),
    "an instancer and its object": lambda scene: link(
        scene, "Key", collection("Group", "Inside", "Floor", exclude=["Inside"])
    ),
    "an instancer named elsewhere": instancer_is_named_elsewhere,
}


@dataclass(frozen=True)
class Relit:
    """(H, W, 3) light with its linking and without, and (H, W) the objects that are seen."""

    linked: NDArray[np.float64]
    unlinked: NDArray[np.float64]
    seen: NDArray[np.int64]
    names: tuple[str, ...]


def relit(scene: Any, *, traced: bool = False) -> Relit:
    """What Relume shows, by shadow maps or by traced shadows."""
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture
    from addon.relight.light_points.light_sample import light_sample
    from addon.relight.lights.light_objects import LightObjects
    from addon.relight.lights.mesh_lights import Glow, mesh_lights
    from addon.relight.shading.shadow import Shadow
    from addon.relight.shadows.shadow_pass import ShadowPass
    from addon.relight.shadows.traced_shadow import TracedShadowPass
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.geometry_reader import read_geometry
    from addon.scene.light_linking import UNLINKED
    from addon.scene.light_linking_reader import read_emitter_linking
    from addon.scene.light_reader import read_lights
    from addon.scene.view_reader import read_view
    from tests.reference.surfaces import surfaces

    from .drawing import drawn_light

    geometry, lights, view, linking = with_render_depsgraph(
        scene,
        lambda d: (
            read_geometry(d),
            read_lights(d),
            read_view(d, scene.camera),
            read_emitter_linking(d),
        ),
    )
    glows = np.array([[GLOW * (name == "glow")] * 3 for name in geometry.material_names])
    for glowing in mesh_lights(geometry, Glow(glows, np.zeros(len(glows), dtype=np.bool_))):
        lights += (replace(glowing, linking=linking.get(glowing.name, UNLINKED)),)
    buffer = GeometryBuffer(geometry, view.origin)
    visible = VisibleSurfacePass(buffer).draw(view, with_objects=True)
    position = read_texture(visible.position).astype(np.float64)
    hit = position[..., 3] > 0.0
    seen = read_texture(visible.objects)[..., 0].astype(np.int64) - 1
    assert ((seen >= 0) == hit).all()
    normal = read_texture(visible.normal).astype(np.float64)[..., :3]
    surface = surfaces(
        position[..., :3], normal, eye=(0, 0, 0), origin=tuple(view.origin), albedo=0.8
    )
    shading = smooth_normals(geometry, seen, position[..., :3] + view.origin, normal)
    surface = replace(
        surface,
        position=position,
        objects=seen,
        channels={**surface.channels, "normal": shading},
    )
    objects, maps, rays = LightObjects(geometry), ShadowPass(buffer), TracedShadowPass(geometry)
    both = np.zeros((2, SIZE, SIZE, 3))
    for light in lights:
        assert not light.warnings
        receivers = position[hit][:, :3] + view.origin
        count = GLOW_POINTS if light.type == "MESH" else 1
        for k, shares in itertools.product(range(count), (objects.of(light), None)):
            sample = light_sample(light, k, count)
            shadow: Shadow
            if traced:
                shadow = rays.draw(
                    surface.upload(),
                    light,
                    sample,
                    casters=objects.caster_triangles(light) if shares else None,
                    objects=shares.texture if shares else None,
                )
            else:
                casters = shares.casters if shares else None
                shadow = maps.draw(light, sample, geometry.bounds, receivers, objects=casters)
            lit = drawn_light(surface, light, [sample], shadow=shadow, shares=shares)
            both[int(shares is None)] += lit[..., :3] / count
    return Relit(both[0], both[1], seen, geometry.object_names)


def smooth_normals(
    geometry: SceneGeometry,
    seen: NDArray[np.int64],
    place: NDArray[np.float64],
    normal: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(H, W, 3): a ball's corners have radial normals, and so has what lies between them."""
    middle = np.zeros((len(geometry.object_names), 3))
    for number in range(len(middle)):
        corners = np.unique(geometry.triangles[geometry.object_id == number])
        middle[number] = geometry.vertices[corners].mean(axis=0)
    radial = place - middle[seen]
    radial /= np.linalg.norm(radial, axis=-1, keepdims=True)
    flat = np.array(geometry.object_names)[seen] == "Floor"
    return np.where(flat[..., None], normal, radial)


def each_alone(scene: Any, folder: Path) -> NDArray[np.float64]:
    """(H, W, 3) by Cycles, the lights added up: without the noise of choosing one."""
    total = np.zeros((SIZE, SIZE, 3))
    lamps = [scene.objects[name].data for name in ("Key", "Fill")]
    energies = [lamp.energy for lamp in lamps]
    for shown in lamps:
        for lamp, energy in zip(lamps, energies, strict=True):
            # Hidden, it would not link anything; black, it does.
            lamp.energy = energy if lamp is shown else 0.0
        total += cycles_picture(scene, folder / "cycles.exr", 4)[..., :3]
    for lamp, energy in zip(lamps, energies, strict=True):
        lamp.energy = energy
    return total


def away_from_edges(seen: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(H, W) pixels of which all within 2 pixels see the same object."""
    padded = np.pad(seen, 2, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, (5, 5))
    return np.asarray((windows == seen[..., None, None]).all(axis=(2, 3)) & (seen >= 0))


def psnr(
    got: NDArray[np.float64], reference: NDArray[np.float64], where: NDArray[np.bool_]
) -> float:
    """Decibels, the peak the brightest of the reference."""
    error = ((got - reference)[where] / reference.max()) ** 2
    return float(-10.0 * np.log10(error.mean()))


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("name", CASES)
def test_case(name: str, scene: Any, tmp_path: Path) -> None:
    CASES[name](scene)
    reference = each_alone(scene, tmp_path)
    result = relit(scene)
    inner = away_from_edges(result.seen)
    # The 45 dB; what is left are single pixels on the edges of hard shadows.
    linked = psnr(result.linked, reference, inner)
    assert linked > 45.0, f"{linked:.1f} dB"
    if name in ("no linking", "no receivers"):
        np.testing.assert_array_equal(result.linked, result.unlinked)
    else:
        # So that the bound above would not hold for a picture that knows nothing of linking.
        unlinked = psnr(result.unlinked, reference, inner)
        assert unlinked < 40.0, f"{unlinked:.1f} dB"


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("name", ["blockers", "blockers, excluded", "an instancer"])
def test_traced_shadows(name: str, scene: Any, tmp_path: Path) -> None:
    CASES[name](scene)
    reference = each_alone(scene, tmp_path)
    result = relit(scene, traced=True)
    traced = psnr(result.linked, reference, away_from_edges(result.seen))
    assert traced > 45.0, f"{traced:.1f} dB"


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("traced", [False, True])
def test_facets_that_cast_no_shadow(traced: bool, scene: Any, tmp_path: Path) -> None:
    """Facets that look away from a light are lit by their smooth normals: nothing blocks it."""
    without_shadow(scene)
    reference = each_alone(scene, tmp_path)
    result = relit(scene, traced=traced)
    ball = result.seen == result.names.index("Middle")
    # No shadow has an edge on it: float32 and the points' places in Cycles are what differs.
    assert psnr(result.linked, reference, ball) > 55.0
    # Without linking, maps have facets shade themselves; traced rays start above them.
    unlinked = psnr(result.unlinked, reference, ball)
    assert unlinked > 55.0 if traced else unlinked < 35.0
    assert psnr(result.linked, reference, away_from_edges(result.seen)) > 45.0


@pytest.mark.usefixtures("gpu_context")
def test_a_glowing_object(scene: Any, tmp_path: Path) -> None:
    """An object's linking counts where it glows: one ball is left out, one casts no shadow."""
    import bpy

    glow: Any = bpy.data.materials.new("glow")
    glow.node_tree.nodes.clear()
    shader = glow.node_tree.nodes.new("ShaderNodeEmission")
    shader.inputs["Strength"].default_value = GLOW
    output = glow.node_tree.nodes.new("ShaderNodeOutputMaterial")
    glow.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    bpy.ops.mesh.primitive_plane_add(size=1, location=(0.0, -0.5, 4.0))
    bpy.context.object.name = "Glow"
    bpy.context.object.data.materials.append(glow)
    for lamp in ("Key", "Fill"):
        bpy.data.objects.remove(scene.objects[lamp])
    link(
        scene,
        "Glow",
        collection("Left", exclude=["Left"]),
        collection("Middle", exclude=["Middle"]),
    )
    reference = cycles_picture(scene, tmp_path / "cycles.exr", 256)[..., :3]
    result = relit(scene, traced=True)
    inner = away_from_edges(result.seen)
    # Means of 4 x 4 pixels: Cycles' noise is then a quarter.
    got, want = (blocks(np.where(inner[..., None], p, 0.0)) for p in (result.linked, reference))
    error = float(np.sqrt(((got - want) ** 2).mean()) / want.max())
    assert error < 10.0 ** (-45.0 / 20.0), f"{-20.0 * np.log10(error):.1f} dB"
    unlinked = blocks(np.where(inner[..., None], result.unlinked, 0.0))
    assert np.sqrt(((unlinked - want) ** 2).mean()) > 5.0 * error * want.max()
    assert not reference[inner & (result.seen == result.names.index("Left"))].any()


def blocks(picture: NDArray[np.float64]) -> NDArray[np.float64]:
    """(H / 4, W / 4, 3) means."""
    height, width, _ = picture.shape
    return picture.reshape(height // 4, 4, width // 4, 4, 3).mean(axis=(1, 3))
