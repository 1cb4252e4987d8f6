# SPDX-License-Identifier: GPL-3.0-or-later
"""The session redoes what depends on a change, and nothing else; its pictures are light."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.plan import ChannelPlan
from addon.camplace.camera import CachingCamera
from addon.errors import InputError
from addon.progress import Cancelled
from addon.relight.shadows.shadow_frustum import ShadowSettings
from addon.scene.geometry import SceneGeometry
from addon.scene.light import Light
from addon.scene.light_controls import (
    BarnDoors,
    LightControls,
    ShadowControls,
    Slide,
    Superellipse,
)
from addon.scene.view import View
from addon.scene.world import World
from tests import synthetic

ALBEDO = 0.6


@dataclass
class MemoryStore:
    """What the session needs of a cache, without a disk."""

    plan: ChannelPlan
    framebuffers: list[DeepFramebuffer]
    folder: Path = field(default=Path("memory.relume"))

    @property
    def cameras(self) -> list[CachingCamera]:
        return [framebuffer.camera for framebuffer in self.framebuffers]

    def pictures_of(self, number: int) -> int:
        return len(self.read_camera(number).pictures)

    def read_camera(self, number: int) -> DeepFramebuffer:
        return next(f for f in self.framebuffers if f.camera.id == number)


def white(points: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.full_like(points, ALBEDO)


def make_store(geometry: SceneGeometry, cameras: list[Any]) -> MemoryStore:
    tracer = synthetic.Tracer(geometry)
    plan = ChannelPlan(
        ("depth", "material_id", "normal", "diffuse_color"), {}, geometry.material_names
    )
    return MemoryStore(
        plan, [synthetic.trace_framebuffer(geometry, tracer, c, white) for c in cameras]
    )


def point_light(name: str, place: tuple[float, float, float], energy: float = 10.0) -> Light:
    world_from_light = np.eye(4)
    world_from_light[:3, 3] = place
    return Light(name, "POINT", world_from_light, energy, np.ones(3))


@pytest.fixture(scope="module")
def room() -> tuple[SceneGeometry, MemoryStore, View]:
    geometry = synthetic.room_with_box()
    store = make_store(geometry, synthetic.cube_cameras((-1.2, -1.0, 1.0), 128))
    view = synthetic.perspective_view(
        synthetic.looking_at((-1.5, -1.6, 0.9), (0.3, 0.2, -0.6)), 64, 48, 1.2
    )
    return geometry, store, view


def open_session(room: tuple[SceneGeometry, MemoryStore, View], samples: int = 2) -> Any:
    from addon.relight.session import RelightSession

    geometry, store, view = room
    session = RelightSession(geometry, cast("Any", store), samples)
    session.set_view(view)
    session.set_world(None)
    return session


@contextmanager
def counted_draws(session: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """The names of the lights that are shaded inside, one entry for each pass."""
    shaded: list[str] = []
    light_pass = session._drawing._light_pass
    real = light_pass.draw

    def draw(surface: Any, light: Light, *args: Any, **kwargs: Any) -> None:
        shaded.append(light.name)
        real(surface, light, *args, **kwargs)

    with monkeypatch.context() as patch:
        patch.setattr(light_pass, "draw", draw)
        yield shaded


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
def test_a_lambert_plane_has_its_radiance_on_paper(gpu_context: None, scale: float) -> None:
    from addon.relight.session import RelightSession

    corners = np.array([[-4.0, -4, 0], [4.0, -4, 0], [4.0, 4, 0], [-4.0, 4, 0]]) * scale
    geometry = synthetic.geometry_of([(corners, np.array([[0, 1, 2], [0, 2, 3]]))])
    store = make_store(geometry, synthetic.cube_cameras((0, 0, 3.0 * scale), 64, far=1e3 * scale))
    view = synthetic.perspective_view(
        synthetic.looking_at((0.5 * scale, -3.0 * scale, 2.0 * scale), (0, 0, 0)),
        64, 48, 0.7, near=0.01 * scale, far=100.0 * scale,
    )  # fmt: skip
    energy = 40.0 * scale**2
    height = 1.5 * scale
    session = RelightSession(geometry, cast("Any", store), samples=1)
    session.set_view(view)
    session.set_world(None)
    session.set_lights([point_light("Lamp", (0.3 * scale, 0.2 * scale, height), energy)])
    picture = session.render()

    x, y = np.meshgrid(np.arange(64) + 0.5, np.arange(48) + 0.5)
    origin, direction = view.rays(np.stack([x, y], axis=-1))
    hit = origin - direction * (origin[..., 2] / direction[..., 2])[..., None]
    toward = np.array([0.3 * scale, 0.2 * scale, height]) - hit
    distance = np.linalg.norm(toward, axis=-1)
    # L = rho Phi cos(theta) / (4 pi^2 d^2), as Cycles has it.
    expected = ALBEDO * energy * (height / distance) / (4.0 * np.pi**2 * distance**2)
    # Half precision of the albedo: 2**-12 of it; the rest is float32.
    assert np.abs(picture.combined[..., 0] / expected - 1.0).max() < 5e-4
    assert (picture.combined[..., 3] == 1.0).all()


def test_pictures_have_the_shadows_of_rays(gpu_context: None, room: Any) -> None:
    geometry, _, view = room
    place = np.array([1.0, -1.2, 1.5])
    session = open_session(room, samples=1)
    session.set_lights([point_light("Lamp", (1.0, -1.2, 1.5))])
    picture = session.render()
    tracer = synthetic.Tracer(geometry)
    x, y = np.meshgrid(np.arange(64) + 0.5, np.arange(48) + 0.5)
    origins, directions = view.rays(np.stack([x, y], axis=-1).reshape(-1, 2))
    triangle, points = tracer.hit(origins, directions)
    toward = points - place
    distance = np.linalg.norm(toward, axis=1)
    _, first = tracer.hit(np.broadcast_to(place, points.shape), toward / distance[:, None])
    lit = np.linalg.norm(first - place, axis=1) > distance * (1.0 - 1e-4)
    cosine = np.abs((geometry.normal[triangle] * toward).sum(1)) / distance
    # The room's walls face inward and the cube's outward: what faces away is in shadow anyway.
    facing = ((toward * geometry.normal[triangle]).sum(1) < 0.0) == (
        (directions * geometry.normal[triangle]).sum(1) < 0.0
    )
    expected = np.where(lit & facing, ALBEDO * 10.0 * cosine / (4.0 * np.pi**2 * distance**2), 0.0)
    found = picture.combined[..., 0].ravel()
    wrong = np.abs(found - expected) > 1e-3 * expected.max()
    assert 0.05 < (expected == 0.0).mean() < 0.95
    # Along a shadow's edge the map's texels and the rays may differ by a pixel.
    assert wrong.mean() < 0.02


def test_layers_add_up(gpu_context: None, room: Any) -> None:
    session = open_session(room)
    session.set_lights([point_light("A", (1, 1, 1.5)), point_light("B", (-1, 1, 1.0), 3.0)])
    session.set_world(World(np.array([0.1, 0.2, 0.3])))
    picture = session.render()
    assert set(picture.layers) == {"A", "B", "World"}
    total = np.sum([*picture.layers.values()], axis=0, dtype=np.float64)
    # Three float32 sums of numbers of order one.
    assert np.abs(picture.combined[..., :3] - total).max() < 1e-6
    assert np.isfinite(picture.combined).all()


def test_lights_may_be_called_anything(gpu_context: None, room: Any) -> None:
    plain, odd = open_session(room), open_session(room)
    for session, names in ((plain, ("A", "B")), (odd, ("World", "Emission"))):
        session.set_lights([point_light(names[0], (1, 1, 1.5)), point_light(names[1], (-1, 1, 1))])
        session.set_world(World(np.array([0.1, 0.2, 0.3])))
    expected, found = plain.render(), odd.render()
    assert set(found.layers) == {"World", "Emission", "World (scene)"}
    assert np.array_equal(found.layers["World (scene)"], expected.layers["World"])
    assert np.array_equal(found.combined[..., 3], expected.combined[..., 3])


def test_an_edit_redoes_one_layer(
    gpu_context: None, room: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = open_session(room)
    lights = [point_light("A", (1, 1, 1.5)), point_light("B", (-1, 1, 1.0))]
    session.set_lights(lights)
    before = session.render()
    edited = [point_light("A", (1, 0.5, 1.5)), lights[1]]
    with counted_draws(session, monkeypatch) as shaded:
        session.set_lights(edited)
        after = session.render()
    assert shaded == ["A", "A"]
    assert np.array_equal(after.layers["B"], before.layers["B"])
    assert not np.array_equal(after.layers["A"], before.layers["A"])
    fresh = open_session(room)
    fresh.set_lights(edited)
    assert np.array_equal(fresh.render().combined, after.combined)


COLOR_EDITS: dict[str, tuple[dict[str, Any], Any]] = {
    "energy": ({"energy": 20.0}, 2.0),
    "exposure": ({"exposure": -1.0}, 0.5),
    "color": ({"color": np.array([1.0, 0.5, 0.0])}, np.array([1.0, 0.5, 0.0])),
    "normalize": ({"normalize": False}, 4.0),
}


@pytest.mark.parametrize("what", COLOR_EDITS)
def test_a_color_edit_shades_nothing(
    gpu_context: None, room: Any, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    attributes, factor = COLOR_EDITS[what]
    session = open_session(room)
    lights = [point_light("A", (1, 1, 1.5)), point_light("B", (-1, 1, 1.0))]
    session.set_lights(lights)
    before = session.render()
    edited = [replace(lights[0], **attributes), lights[1]]
    with counted_draws(session, monkeypatch) as shaded:
        session.set_lights(edited)
        after = session.render()
    assert shaded == []
    assert np.array_equal(after.layers["B"], before.layers["B"])
    expected = before.layers["A"] * factor
    # Without extent and not normalized, a point's power is Phi instead of Phi / (4 pi) / (1 / pi).
    assert np.abs(after.layers["A"] - expected).max() <= 1e-6 * expected.max()
    fresh = open_session(room)
    fresh.set_lights(edited)
    assert np.array_equal(fresh.render().combined, after.combined)


def test_shaping_a_light_keeps_its_shadow_maps(
    gpu_context: None, room: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = open_session(room, samples=3)
    lamp = Light(
        "Spot", "SPOT", synthetic.looking_at((1, 1, 1.5), (0, 0, -1)), 10.0, np.ones(3),
        shadow_soft_size=0.1,
    )  # fmt: skip
    session.set_lights([lamp])
    session.render()
    drawn: list[str] = []
    real = session._drawing._pass.draw

    def draw(light: Light, *args: Any, **kwargs: Any) -> Any:
        drawn.append(light.name)
        return real(light, *args, **kwargs)

    monkeypatch.setattr(session._drawing._pass, "draw", draw)
    session.set_lights([replace(lamp, spot_blend=0.9)])
    shaped = session.render()
    assert drawn == []
    session.set_lights([replace(lamp, spot_blend=0.9, shadow_soft_size=0.2)])
    session.render()
    assert len(drawn) == 3
    fresh = open_session(room, samples=3)
    fresh.set_lights([replace(lamp, spot_blend=0.9)])
    assert np.array_equal(fresh.render().combined, shaped.combined)


def test_ten_thousand_edits_do_not_drift(gpu_context: None, room: Any) -> None:
    from addon.glsl.shader import read_texture

    session = open_session(room, samples=1)
    random = np.random.default_rng(5)
    lights = [point_light(f"L{k}", tuple(random.uniform(-1, 1.5, 3)), 5.0) for k in range(6)]
    session.set_lights(lights)
    session.render()
    for _ in range(10_000):
        which = int(random.integers(6))
        lights[which] = replace(lights[which], energy=float(10.0 ** random.uniform(-3, 3)))
        session.set_lights(lights)
        texture = session.draw_combined()
    found = read_texture(texture).astype(np.float64)
    fresh = open_session(room, samples=1)
    fresh.set_lights(lights)
    expected = fresh.render().combined
    assert np.abs(found - expected).max() <= 1e-5 * expected.max()


def test_muted_layers_are_silent_and_kept(
    gpu_context: None, room: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = open_session(room)
    a, b = point_light("A", (1, 1, 1.5)), point_light("B", (-1, 1, 1.0), 3.0)
    session.set_lights([a, b])
    session.set_world(World(np.array([0.1, 0.2, 0.3])))
    every = session.render()
    expected = {
        "A mute": ([replace(a, mute=True), b], False, {"B", "World"}),
        "B solo": ([a, replace(b, solo=True)], False, {"B"}),
        "solo beats mute": ([replace(a, mute=True, solo=True), b], False, {"A"}),
        "world mute": ([a, b], True, {"A", "B"}),
    }
    with counted_draws(session, monkeypatch) as shaded:
        for what, (lights, world, names) in expected.items():
            session.set_lights(lights)
            session.set_muted(world=world, emission=False)
            found = session.render()
            assert set(found.layers) == names, what
            total = np.sum([every.layers[name] for name in names], axis=0, dtype=np.float64)
            assert np.abs(found.combined[..., :3] - total).max() < 1e-6, what
            # What is opaque stays so.
            assert np.array_equal(found.combined[..., 3], every.combined[..., 3]), what
        session.set_lights([a, b])
        session.set_muted(world=False, emission=False)
        again = session.render()
    assert shaded == []
    assert np.array_equal(again.combined, every.combined)


def test_lobes_add_up_to_their_layer(gpu_context: None, room: Any) -> None:
    from addon.relight.session import RelightSession

    geometry, store, view = room
    session = RelightSession(geometry, cast("Any", store), 2, split_lobes=True)
    session.set_view(view)
    session.set_world(World(np.array([0.1, 0.2, 0.3])))
    session.set_lights([point_light("A", (1, 1, 1.5))])
    split = session.render()
    whole = open_session(room)
    whole.set_world(World(np.array([0.1, 0.2, 0.3])))
    whole.set_lights([point_light("A", (1, 1, 1.5))])
    assert set(split.lobes) == {"A"}
    assert set(split.lobes["A"]) == {"diffuse"}
    assert np.array_equal(split.lobes["A"]["diffuse"], split.layers["A"])
    assert np.array_equal(split.combined, whole.render().combined)


def test_a_slow_view_is_shown_coarsely_first(gpu_context: None, room: Any) -> None:
    from addon.glsl.shader import read_texture

    session = open_session(room)
    session.set_lights([point_light("A", (1, 1, 1.5))])
    fine = session.render().combined
    session._stages.preview_s = 1.0
    session.set_lights([point_light("A", (1, 0.9, 1.5))])
    assert session.step()
    coarse = read_texture(session.draw_combined())
    session.step()
    full = read_texture(session.draw_combined())
    blocks = coarse.reshape(12, 4, 16, 4, 4)
    assert (blocks == blocks[:, :1, :, :1]).all(axis=(1, 3)).mean() > 0.9
    # A coarse pixel shows the one in its middle.
    lit = full[..., 3] > 0.0
    same = np.abs(coarse[2::4, 2::4] - full[2::4, 2::4])[lit[2::4, 2::4]]
    assert np.median(same) <= 1e-6
    assert not np.array_equal(full, fine)


def test_traced_shadows(gpu_context: None, room: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both ways show one picture, but for pixels at the shadows' edges; changing the way redoes
    the lights' layers, and no other."""
    session = open_session(room)
    session.set_lights([point_light("A", (1, 1, 1.5))])
    maps = session.render().layers["A"]
    with counted_draws(session, monkeypatch) as shaded:
        session.set_shadows(ShadowSettings(method="traced"))
        traced = session.render().layers["A"]
        session.set_shadows(ShadowSettings(method="traced"))
        assert not session.step()
    assert shaded == ["A", "A"]
    off = np.abs(traced - maps).max(axis=-1) > 1e-5 * maps.max()
    assert 0.0 < off.mean() < 0.03
    # Moved objects cast other shadows.
    geometry, _, _ = room
    vertices = geometry.vertices.copy()
    vertices[8:] += [0.0, 0.0, 0.3]
    session.set_geometry(replace(geometry, vertices=vertices))
    moved = session.render().layers["A"]
    session.set_shadows(ShadowSettings())
    off = np.abs(session.render().layers["A"] - moved).max(axis=-1) > 1e-5 * maps.max()
    assert off.mean() < 0.03


def test_glowing_objects_light_others(gpu_context: None, room: Any) -> None:
    """The box glows: it has a layer of its name, which goes with its material's edits."""
    from addon.scene.surface_edit import SurfaceEdit, SurfaceEdits

    geometry, store, view = room
    glow = {"emission": ((0.0, 0.0, 0.0), (1.0, 2.0, 3.0))}
    glowing = (geometry, replace(store, plan=replace(store.plan, material_constants=glow)), view)
    session = open_session(glowing, samples=4)
    box = geometry.object_names[1]
    session.set_lights([])
    picture = session.render()
    layer = picture.layers[box]
    assert set(picture.layers) == {box, "World", "Emission"}
    # Walls get light, of its colour; a closed convex thing does not light itself.
    seen = layer.max(axis=-1) > 0.0
    assert seen.mean() > 0.3
    assert np.allclose(layer[seen] / layer[seen][:, :1], [1.0, 2.0, 3.0], rtol=1e-5)
    assert layer[picture.layers["Emission"].max(axis=-1) > 2.99].max() < 1e-6 * layer.max()
    assert picture.glowing == (box,)
    session.set_muted(world=False, emission=True)
    assert set(session.render().layers) == {"World"}
    session.set_muted(world=False, emission=False)
    with pytest.raises(InputError, match=f"does not glow; those that do are: '{box}'"):
        session.set_glow_mix([box], ["nothing"])
    lamp = point_light("A", (1, 1, 1.5))
    session.set_lights([lamp])
    session.set_glow_mix([box], [])
    assert set(session.render().layers) == {box}
    session.set_glow_mix([], [box])
    assert set(session.render().layers) == {"A", "World", "Emission"}
    session.set_glow_mix([], [])
    session.set_lights([])
    session.set_surface_edits(
        SurfaceEdits(materials={geometry.material_names[1]: SurfaceEdit(emission=0.5)})
    )
    half = session.render().layers[box]
    assert np.allclose(half, 0.5 * layer, rtol=1e-5, atol=1e-9)
    # Beside a sun that is ten thousand times brighter it has no layer, and that is said. A sun
    # that the room's walls keep out, or a spot or a lamp behind doors that look away, takes
    # nothing of it.
    sun = Light("Sun", "SUN", synthetic.looking_at((0, 0, 0), (0.2, 0.1, -1)), 1e5, np.ones(3))
    everywhere = replace(sun, use_shadow=False)
    session.set_lights([everywhere])
    assert box not in session.render().layers
    assert any("light nothing" in text and box in text for text in session.warnings)
    away = synthetic.looking_at((0.0, 0.0, 1.2), (0.1, 0.0, 2.2))
    spot = Light("Spot", "SPOT", away, 1e8, np.ones(3), spot_size=0.02, spot_blend=0.0)
    doors = LightControls(barn_doors=BarnDoors(Superellipse(0.01, 0.01)))
    lamp = Light("Lamp", "POINT", away, 1e8, np.ones(3), use_shadow=False, controls=doors)
    for dark in (sun, spot, lamp):
        session.set_lights([dark])
        assert np.array_equal(session.render().layers[box], half), dark.name
    session.set_lights([everywhere])
    assert box not in session.render().layers
    # A mute sun outshines nothing.
    session.set_lights([replace(everywhere, mute=True)])
    assert np.array_equal(session.render().layers[box], half)


def test_nothing_changed_means_no_work(
    gpu_context: None, room: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = open_session(room)
    session.set_lights([point_light("A", (1, 1, 1.5))])
    session.render()
    with counted_draws(session, monkeypatch) as shaded:
        session.set_lights([point_light("A", (1, 1, 1.5))])
        session.set_view(room[2])
        assert not session.step()
    assert shaded == []


def test_removed_lights_leave_the_picture(gpu_context: None, room: Any) -> None:
    session = open_session(room)
    session.set_lights([point_light("A", (1, 1, 1.5))])
    assert session.render().combined[..., :3].max() > 0.0
    session.set_lights([])
    assert session.render().combined[..., :3].max() == 0.0


def test_steps_end_at_the_render(gpu_context: None, room: Any) -> None:
    from addon.glsl.shader import read_texture

    session = open_session(room, samples=5)
    session.set_lights([replace(point_light("A", (1, 1, 1.5)), shadow_soft_size=0.2)])
    pictures: list[NDArray[np.float32]] = []
    listed = False
    while session.step():
        # After the previews the pixels' lists are made, which shows nothing new.
        if len(pictures) < 2 or listed:
            pictures.append(read_texture(session.draw_combined()))
        listed = session._sampler.lists is not None
    # Of the lamp and of the world: the centred preview first, then five samples.
    assert len(pictures) == 12
    assert np.array_equal(pictures[-1], session.render().combined)
    # The first picture shows the whole scene already.
    assert np.abs(pictures[1] - pictures[-1]).mean() < 0.1 * pictures[-1].mean()


def test_a_camera_move_equals_a_new_session(gpu_context: None, room: Any) -> None:
    geometry, store, _ = room
    other = synthetic.perspective_view(
        synthetic.looking_at((-1.4, -1.5, 1.2), (0.3, 0.2, -0.6)), 64, 48, 1.0
    )
    sun = Light("Sun", "SUN", synthetic.looking_at((0, 0, 0), (0.2, 0.1, -1)), 2.0, np.ones(3))
    moved = open_session(room)
    moved.set_lights([point_light("A", (1, 1, 1.5)), sun])
    while moved.step():
        pass
    moved.set_view(other)
    fresh = open_session((geometry, store, other))
    fresh.set_lights([point_light("A", (1, 1, 1.5)), sun])
    # Local space lies at the first view in one and the second in the other: only rounding
    # differs, and what lies on an edge of a shadow or triangle.
    difference = np.abs(moved.render().combined - fresh.render().combined).max(axis=-1)
    assert np.percentile(difference, 98) < 1e-5


def test_the_first_picture_after_a_move_has_fewer_rays(
    gpu_context: None, room: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is that of a new session but for few pixels; an edit of a light has all rays, and so has
    all that comes later. All lights have their times."""
    from addon.glsl.shader import read_texture
    from addon.relight.shadows.traced_shadow import TracedShadow, TracedShadowPass

    drawn: list[tuple[bool, int]] = []
    of: list[tuple[str, int]] = []
    real = TracedShadowPass.draw

    def draw(self: Any, *args: Any, **options: Any) -> TracedShadow:
        shadow = real(self, *args, **options)
        drawn.append((options["sparse"], shadow.rays))
        of.append((args[1].name, options["stride"]))
        return shadow

    monkeypatch.setattr(TracedShadowPass, "draw", draw)
    geometry, store, _ = room
    lights = [point_light("A", (1, 1, 1.5)), point_light("B", (-1, 1, 1.2))]

    def first_picture(session: Any) -> Any:
        drawn.clear()
        of.clear()
        while session.shown_stride != 1:
            session.step()
        return read_texture(session.draw_combined())

    def open_traced(place: tuple[float, float, float]) -> Any:
        camera = synthetic.looking_at(place, (0.3, 0.2, -0.6))
        looks = synthetic.perspective_view(camera, 192, 144, 1.0)
        session = open_session((geometry, store, looks), 8)
        session.set_shadows(ShadowSettings(method="traced"))
        session.set_lights(lights)
        return session, looks

    fresh, other = open_traced((-1.4, -1.5, 1.2))
    whole = first_picture(fresh)
    every = sum(rays for _, rays in drawn)
    assert [sparse for sparse, _ in drawn] == [False, False]
    moved, _ = open_traced((-1.5, -1.6, 0.9))
    first_picture(moved)
    moved.set_view(other)
    few = first_picture(moved)
    assert [sparse for sparse, _ in drawn] == [True, True]
    assert sum(rays for _, rays in drawn) < 0.5 * every
    difference = np.abs(few - whole).max(axis=-1)
    assert np.mean(difference > 1e-4 * whole.max()) < 0.01
    graph = moved.graph
    assert all(graph.seconds(f"Light {name}") is not None for name in "AB")
    # An edit, and what comes after the first picture.
    moved.set_lights([point_light("A", (1, 0.9, 1.5)), lights[1]])
    first_picture(moved)
    assert not any(sparse for sparse, _ in drawn)
    # Where drawing is slow, coarser pictures of it come before.
    assert {name for name, _ in of} == {"A"}
    assert of.count(("A", 1)) == 1
    drawn.clear()
    while moved.step():
        pass
    assert drawn
    assert not any(sparse for sparse, _ in drawn)


def test_moved_objects_are_seen_moved(gpu_context: None, room: Any) -> None:
    geometry, _, _ = room
    session = open_session(room)
    session.set_lights([point_light("A", (1, 1, 1.5))])
    before = session.render().combined
    vertices = geometry.vertices.copy()
    vertices[8:] += [0.0, 0.0, 0.3]
    session.set_geometry(replace(geometry, vertices=vertices))
    assert np.abs(session.render().combined - before).max() > 0.01


def test_a_world_that_was_not_baked_is_named(gpu_context: None, room: Any) -> None:
    session = open_session(room)
    assert session.warnings == ()
    session.set_world(World(np.array([0.1, 0.2, 0.3])))
    assert "without the world's light" in session.warnings[0]


def test_without_a_view_there_is_no_picture(gpu_context: None, room: Any) -> None:
    from addon.relight.session import RelightSession

    session = RelightSession(room[0], cast("Any", room[1]))
    with pytest.raises(RuntimeError, match="view"):
        session.render()


def test_an_empty_cache_is_refused(gpu_context: None, room: Any) -> None:
    from addon.relight.session import RelightSession

    with pytest.raises(InputError, match=r"memory\.relume has no finished camera"):
        RelightSession(room[0], cast("Any", MemoryStore(room[1].plan, [])))


def test_a_cancelled_render_goes_on_where_it_was(gpu_context: None, room: Any) -> None:
    session = open_session(room, samples=4)
    session.set_lights([point_light("A", (1, 1, 1.5))])

    def stop(_fraction: float, message: str) -> None:
        if message.startswith("Sample 3 of 4"):
            raise Cancelled

    with pytest.raises(Cancelled):
        session.render(stop)
    assert session.samples_done == 2
    fresh = open_session(room, samples=4)
    fresh.set_lights([point_light("A", (1, 1, 1.5))])
    assert np.array_equal(session.render().combined, fresh.render().combined)


@pytest.mark.parametrize("energy", [1e-9, 1e9])
def test_extreme_energies_stay_in_proportion(gpu_context: None, room: Any, energy: float) -> None:
    session = open_session(room)
    session.set_lights([point_light("A", (1, 1, 1.5), 1.0)])
    unit = session.render().layers["A"].astype(np.float64)
    session.set_lights([point_light("A", (1, 1, 1.5), energy)])
    layer = session.render().layers["A"].astype(np.float64)
    assert np.isfinite(layer).all()
    lit = unit > 0.0
    # Products of a few float32 factors.
    assert np.abs(layer[lit] / (energy * unit[lit]) - 1.0).max() < 1e-5


def test_a_shader_is_announced_before_it_is_compiled(gpu_context: None, room: Any) -> None:
    from addon.glsl import shader

    session = open_session(room, samples=2)
    lamp = point_light("A", (1, 1, 1.5))
    session.set_lights([lamp])
    expected = session.render().combined
    # All shaders of an edit are there, whatever ran before.
    session._touch("A: shape")
    while session.step():
        pass
    # As if nothing had been compiled for lights yet.
    session._drawing._light_pass._programs.clear()
    lights = [each for each in shader._programs if each.name.startswith("light_")]
    kept = {each: shader._programs.pop(each) for each in lights}
    shader._Announcements.made.difference_update(lights)
    session._touch("A: shape")
    said = []
    while session.step(announce=True):
        said.append(session.compiling)
    assert [name for name in said if name] == ["light_point"]
    assert said[0] == "light_point"
    # What was announced was drawn afterwards, and nothing twice.
    assert np.array_equal(session.render().combined, expected)
    shader._programs.update(kept)


def test_the_graph_knows_what_is_done(gpu_context: None, room: Any) -> None:
    session = open_session(room, samples=2)
    session.set_lights([point_light("A", (1, 1, 1.5)), point_light("B", (-1, 1, 1.0))])

    def dirty() -> set[str]:
        return {each.name for each in session.graph.passes if session.graph.is_dirty(each.name)}

    layers = {"Light A", "Light B", "World"}
    shadows = {"Shadows of A", "Shadows of B"}
    assert dirty() == {
        *layers, *shadows, "Picture", "Visible surface", "Correspondence map", "Surfaces",
    }  # fmt: skip
    session.step()
    assert dirty() == {*layers, *shadows, "Picture"}
    while session.step():
        pass
    assert dirty() == set()
    session.set_lights([point_light("A", (1, 0.5, 1.5)), point_light("B", (-1, 1, 1.0))])
    assert dirty() == {"Light A", "Shadows of A", "Picture"}
    session.render()
    assert dirty() == set()


def test_what_was_made_for_a_light_goes_with_it(gpu_context: None, room: Any) -> None:
    session = open_session(room)
    session.set_lights([point_light("A", (1, 1, 1.5)), point_light("B", (-1, 1, 1.0))])
    session.render()
    made = session._drawing._light_pass._filters._made
    assert set(made) == {"A", "B"}
    session.set_lights([point_light("B", (-1, 1, 1.0))])
    session.render()
    assert set(made) == {"B"}


def test_a_slide_is_uploaded_once(
    gpu_context: None, room: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The passes that shade and that trace share it, though its light's shadows are softened."""
    from addon.relight.filters import slide as slides

    made: list[Slide] = []
    real = slides._slide_filter

    def counted(slide: Slide) -> Any:
        made.append(slide)
        return real(slide)

    monkeypatch.setattr(slides, "_slide_filter", counted)
    picture = Slide(np.full((2, 2, 4), 0.5, dtype=np.float32), "half")
    for shadow in (ShadowControls(), ShadowControls(softness=2.0, offset=(0.1, 0.0, 0.0))):
        made.clear()
        session = open_session(room, samples=2)
        session.set_shadows(ShadowSettings(method="traced"))
        lamp = replace(point_light("A", (1, 1, 1.5)), shadow_soft_size=0.05)
        session.set_lights([replace(lamp, controls=LightControls(slide=picture, shadow=shadow))])
        assert session.render().layers["A"].max() > 0.0
        assert len(made) == 1
