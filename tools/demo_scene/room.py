# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo's room: what stands where, its lights, and the camera's way through it.

The room is 4.8 by 4 metres and 2.7 high, with the origin on the floor in its middle; the
window is in the wall at negative X, and the camera looks towards the wall at positive Y.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import bpy
import numpy as np

from . import images, materials, shapes

WIDTH, DEPTH, HEIGHT = 4.8, 4.0, 2.7
# The shot: frame, camera's place, the point it looks at.
CAMERA_KEYS = (
    (1, (1.95, -1.55, 1.62), (-0.45, 0.75, 0.85)),
    (50, (0.55, -1.72, 1.50), (-0.20, 0.80, 0.92)),
    (100, (-1.15, -1.60, 1.38), (0.25, 0.80, 0.90)),
)
# Frames that the demo renders, on the way and not at its keys alone.
SHOT_FRAMES = (1, 67, 100)
# What the demo does to the lights, in the words of `relume relight --lights`.
LIGHT_EDITS: dict[str, dict[str, Any] | None] = {
    "Pendant": {"location": [0.35, 0.15, 1.86], "color": [1.0, 0.32, 0.16], "energy": 120.0},
    "Fill": {"location": [-1.9, -1.3, 2.35], "color": [0.22, 0.45, 1.0], "energy": 150.0},
}
TABLE = (-0.35, 0.55, 0.0)
TABLE_TOP = 0.76
LAMP = (-1.72, 1.60, 0.0)
WINDOW_Y, WINDOW_Z = (-0.35, 1.05), (0.85, 2.15)


def build(path: Path) -> None:
    """Build the scene and write it to `path`; whatever was open in Blender is gone."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.data.scenes[0]
    scene.name = "Demo"
    _settings(scene)
    _walls()
    _window()
    _table()
    _bookshelf()
    _decoration()
    _screen_and_plant()
    _lamps()
    _lights()
    _camera(scene)
    path.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path.resolve()), compress=True)


def _settings(scene: Any) -> None:
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = 640, 480
    scene.frame_start, scene.frame_end = CAMERA_KEYS[0][0], CAMERA_KEYS[-1][0]
    scene.view_settings.view_transform = "Standard"
    scene.world = bpy.data.worlds.new("World")
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0


def _walls() -> None:
    x, y = WIDTH / 2, DEPTH / 2
    plaster = materials.paint("Plaster", (0.62, 0.60, 0.54), 0.7, grain=0.002)
    accent = materials.paint("Wall paint", (0.16, 0.29, 0.31), 0.65, grain=0.002)
    skirting = materials.paint("White paint", (0.72, 0.71, 0.68), 0.35)
    thick = 0.16
    floor = shapes.boxes("Floor", [((0, 0, -0.05), (WIDTH, DEPTH, 0.1))])
    shapes.place(floor, "Floor", [materials.floor_boards()])
    ceiling = shapes.boxes("Ceiling", [((0, 0, HEIGHT + 0.05), (WIDTH, DEPTH, 0.1))])
    shapes.place(ceiling, "Ceiling", [plaster])
    middle = HEIGHT / 2
    back = shapes.boxes("Back wall", [((0, y + thick / 2, middle), (WIDTH, thick, HEIGHT))])
    shapes.place(back, "Back wall", [accent])
    low, high = WINDOW_Z
    near, far = WINDOW_Y
    left = -x - thick / 2
    sides = [
        ((0, -y - thick / 2, middle), (WIDTH, thick, HEIGHT)),
        ((x + thick / 2, 0, middle), (thick, DEPTH, HEIGHT)),
        ((left, (near - y) / 2, middle), (thick, near + y, HEIGHT)),
        ((left, (far + y) / 2, middle), (thick, y - far, HEIGHT)),
        ((left, (near + far) / 2, low / 2), (thick, far - near, low)),
        ((left, (near + far) / 2, (high + HEIGHT) / 2), (thick, far - near, HEIGHT - high)),
    ]
    shapes.place(shapes.boxes("Side walls", sides), "Side walls", [plaster])
    board = 0.09
    boards = [
        ((0, y - 0.008, board / 2), (WIDTH, 0.016, board)),
        ((x - 0.008, 0, board / 2), (0.016, DEPTH - 0.04, board)),
        ((-x + 0.008, 0, board / 2), (0.016, DEPTH - 0.04, board)),
    ]
    shapes.place(shapes.boxes("Skirting", boards), "Skirting", [skirting])


def _window() -> None:
    low, high = WINDOW_Z
    near, far = WINDOW_Y
    x, y, z = -WIDTH / 2 - 0.06, (near + far) / 2, (low + high) / 2
    width, height, bar = far - near, high - low, 0.05
    parts = [
        ((x, y, low + bar / 2), (bar, width, bar)),
        ((x, y, high - bar / 2), (bar, width, bar)),
        ((x, near + bar / 2, z), (bar, bar, height - 2 * bar)),
        ((x, far - bar / 2, z), (bar, bar, height - 2 * bar)),
        ((x, y, z), (bar, bar, height - 2 * bar)),
        ((x, y - width / 4, z), (0.7 * bar, width / 2 - 1.5 * bar, 0.7 * bar)),
        ((x, y + width / 4, z), (0.7 * bar, width / 2 - 1.5 * bar, 0.7 * bar)),
        ((-WIDTH / 2 + 0.06, y, low - 0.02), (0.24, width + 0.16, 0.04)),
    ]
    frame = shapes.boxes("Window", parts, bevel=0.004)
    shapes.place(frame, "Window", [materials.paint("Window paint", (0.75, 0.74, 0.70), 0.3)])
    # What is seen through the window: it glows, and lets the sun through.
    card = shapes.sheet("Sky", 3.2, 2.8)
    sky = shapes.place(
        card, "Sky", [materials.glow("Sky", (0.36, 0.58, 0.90), 0.9)],
        (-WIDTH / 2 - 0.6, y, 0.3), (0, 0, np.pi / 2),
    )  # fmt: skip
    sky.visible_shadow = False


def _table() -> None:
    x, y, _ = TABLE
    oak = materials.wood("Oak", (0.30, 0.16, 0.08), (0.50, 0.31, 0.17), 0.32)
    black = materials.paint("Black iron", (0.03, 0.03, 0.035), 0.45)
    top = TABLE_TOP
    edge = [(0.0, top - 0.04), (0.55, top - 0.04), (0.60, top - 0.03), (0.615, top - 0.015)]
    edge += [(0.60, top - 0.002), (0.585, top), (0.0, top)]
    shapes.place(shapes.lathe("Table top", edge, 64), "Table top", [oak], (x, y, 0))
    foot = shapes.curve_profile(
        [(0.30, 0.0), (0.29, 0.03), (0.08, 0.08), (0.045, 0.30), (0.06, 0.55), (0.16, top - 0.04)]
    )
    shapes.place(shapes.lathe("Table foot", foot), "Table foot", [black], (x, y, 0))
    for number, (dx, dy, turn) in enumerate(((-0.82, -0.20, -1.25), (0.74, -0.38, 1.05))):
        _chair(f"Chair {number + 1}", oak, (x + dx, y + dy, 0), turn)
    statue = shapes.place(
        shapes.monkey("Statue", 0.21), "Statue", [materials.patina()],
        (x - 0.13, y + 0.12, top + 0.215), (-0.22, 0.0, 0.22),
    )  # fmt: skip
    statue.modifiers.new("Subdivision", "SUBSURF").levels = 2
    statue.modifiers["Subdivision"].render_levels = 2
    _table_ware(x, y, top)


def _table_ware(x: float, y: float, top: float) -> None:
    glaze = materials.paint("Glaze", (0.10, 0.22, 0.42), 0.22)
    bowl = shapes.curve_profile(
        [(0.0, 0.012), (0.06, 0.0), (0.07, 0.012), (0.15, 0.055), (0.175, 0.10), (0.168, 0.10),
         (0.14, 0.06), (0.05, 0.022), (0.0, 0.02)], 6,
    )  # fmt: skip
    shapes.place(shapes.lathe("Bowl", bowl, 56), "Bowl", [glaze], (x + 0.26, y - 0.20, top))
    peel = materials.peel()
    for number, (dx, dy, dz) in enumerate(
        ((0.05, 0.03, 0.075), (-0.06, 0.025, 0.075), (0.0, -0.065, 0.075), (0.0, 0.005, 0.15))
    ):
        place = (x + 0.26 + dx, y - 0.20 + dy, top + dz)
        orange = shapes.sphere(f"Orange {number + 1}", 0.05, 24)
        shapes.place(orange, f"Orange {number + 1}", [peel], place)
    copper = materials.metal("Copper", (0.93, 0.52, 0.36), 0.30)
    jug = shapes.curve_profile(
        [(0.0, 0.0), (0.07, 0.0), (0.095, 0.06), (0.075, 0.15), (0.042, 0.22), (0.058, 0.28),
         (0.052, 0.28), (0.036, 0.22), (0.0, 0.20)], 8,
    )  # fmt: skip
    shapes.place(shapes.lathe("Jug", jug, 56), "Jug", [copper], (x + 0.24, y + 0.22, top))


def _chair(name: str, material: Any, at: shapes.Vec, turn: float) -> None:
    """A chair whose seat looks along its own negative X... towards the table it is turned to."""
    seat, half, leg = 0.45, 0.19, 0.036
    corners = [(sx * half, sy * half) for sx in (-1, 1) for sy in (-1, 1)]
    parts: list[tuple[Any, ...]] = [((0, 0, seat), (0.44, 0.44, 0.035))]
    parts += [((cx, cy, seat / 2 - 0.012), (leg, leg, seat - 0.024)) for cx, cy in corners]
    parts += [((sx * half, -half, 0.70), (leg, leg, 0.46)) for sx in (-1, 1)]
    parts += [((0, -half, 0.90), (0.35, 0.022, 0.10)), ((0, -half, 0.72), (0.35, 0.022, 0.07))]
    shapes.place(shapes.boxes(name, parts, bevel=0.006), name, [material], at, (0, 0, turn))


def _bookshelf() -> None:
    x, y, width, depth, height = 1.62, 1.82, 1.15, 0.30, 1.86
    board = 0.03
    walnut = materials.wood("Walnut", (0.12, 0.06, 0.035), (0.24, 0.13, 0.07), 0.4)
    shelves = np.linspace(board / 2, height - board / 2, 6)
    parts: list[tuple[Any, ...]] = [((x, y, z), (width - 2 * board, depth, board)) for z in shelves]
    parts += [
        ((x + side * (width - board) / 2, y, height / 2), (board, depth, height))
        for side in (-1, 1)
    ]
    parts += [((x, y + depth / 2 - 0.006, height / 2), (width, 0.012, height))]
    shapes.place(shapes.boxes("Bookshelf", parts, bevel=0.003), "Bookshelf", [walnut])
    covers = ((0.42, 0.10, 0.08), (0.10, 0.20, 0.34), (0.46, 0.36, 0.16), (0.12, 0.28, 0.18),
              (0.56, 0.50, 0.40), (0.26, 0.12, 0.24))  # fmt: skip
    random = np.random.default_rng(11)
    books: list[tuple[Any, ...]] = []
    for z in shelves[:-1]:
        left = x - width / 2 + board + 0.01
        end = left + (width - 2 * board) * random.uniform(0.55, 0.97)
        while left < end:
            thick, tall, deep = random.uniform((0.022, 0.19, 0.15), (0.055, 0.29, 0.22))
            if left + thick > x + width / 2 - board:
                break
            center = (left + thick / 2, y - depth / 2 + 0.03 + deep / 2, z + (board + tall) / 2)
            books.append((center, (0.96 * thick, deep, tall), (0, 0, 0), int(random.integers(6))))
            left += thick
    slots = [materials.paint(f"Cover {i + 1}", color, 0.5) for i, color in enumerate(covers)]
    shapes.place(shapes.boxes("Books", books), "Books", slots)


def _decoration() -> None:
    rug = shapes.carpet("Rug", 2.5, 1.875)
    shapes.place(
        rug, "Rug", [materials.woven("Rug", images.rug())], (-0.3, 0.25, 0.008), (0, 0, 0.08)
    )
    wall, z, width, height, bar = DEPTH / 2, 1.62, 1.08, 0.72, 0.06
    x = -0.32
    canvas = shapes.sheet("Painting", width, height)
    art = materials.picture("Painting", images.painting())
    shapes.place(canvas, "Painting", [art], (x, wall - 0.025, z - height / 2))
    gold = materials.metal("Gilt", (0.88, 0.66, 0.32), 0.38)
    parts = [
        ((x, wall - 0.025, z + side * (height + bar) / 2), (width + 2 * bar, 0.05, bar))
        for side in (-1, 1)
    ] + [((x + side * (width + bar) / 2, wall - 0.025, z), (bar, 0.05, height)) for side in (-1, 1)]
    shapes.place(shapes.boxes("Picture frame", parts, bevel=0.012), "Picture frame", [gold])


def _screen_and_plant() -> None:
    cut = materials.cut_out("Lattice", images.lattice(), 0.5)
    panel_width, panel_height = 0.52, 1.39
    at, turn = np.array([-2.22, 0.74]), 0.95
    for number in range(3):
        along = np.array([np.cos(turn), np.sin(turn)])
        middle = at + 0.5 * panel_width * along
        panel = shapes.sheet(f"Screen {number + 1}", panel_width, panel_height)
        shapes.place(
            panel, f"Screen {number + 1}", [cut], (float(middle[0]), float(middle[1]), 0.02),
            (0, 0, turn),
        )  # fmt: skip
        at = at + panel_width * along
        turn -= 0.95 if number % 2 == 0 else -0.95
    clay = materials.paint("Clay", (0.50, 0.22, 0.12), 0.6)
    pot = shapes.curve_profile(
        [(0.0, 0.0), (0.12, 0.0), (0.17, 0.24), (0.20, 0.33), (0.20, 0.37), (0.18, 0.37),
         (0.16, 0.32), (0.0, 0.31)], 5,
    )  # fmt: skip
    place = (0.72, 1.62, 0.0)
    shapes.place(shapes.lathe("Pot", pot, 48), "Pot", [clay], place)
    leaves = shapes.leaves("Plant", 26, 0.95, seed=5)
    green = materials.cut_out("Leaf", images.leaf(), 0.42)
    shapes.place(leaves, "Plant", [green], (place[0], place[1], 0.30))


def _lamps() -> None:
    """The pendant over the table and the lamp on the shelf, without their lights."""
    brass = materials.metal("Brass", (0.86, 0.63, 0.30), 0.34)
    x, y, _ = TABLE
    shade = [(0.02, 2.06), (0.045, 2.05), (0.10, 1.98), (0.19, 1.84), (0.185, 1.84)]
    shade += [(0.095, 1.975), (0.04, 2.04), (0.0, 2.045)]
    shapes.place(shapes.lathe("Pendant shade", shade, 56), "Pendant shade", [brass], (x, y, 0))
    cord = [(0.0, 2.05), (0.012, 2.05), (0.012, HEIGHT), (0.0, HEIGHT)]
    cord_paint = materials.paint("Cord", (0.05, 0.05, 0.05), 0.6)
    shapes.place(shapes.lathe("Cord", cord, 12), "Cord", [cord_paint], (x, y, 0))
    black = materials.paint("Lamp paint", (0.06, 0.05, 0.05), 0.55)
    foot = [(0.0, 0.0), (0.13, 0.0), (0.13, 0.02), (0.016, 0.035), (0.016, 1.27), (0.0, 1.27)]
    at = LAMP
    shapes.place(shapes.lathe("Lamp foot", foot, 32), "Lamp foot", [black], at)
    linen = materials.paint("Linen", (0.78, 0.70, 0.55), 0.8)
    drum = shapes.lathe("Lamp shade", [(0.21, 1.26), (0.15, 1.56)], 56)
    shapes.place(drum, "Lamp shade", [linen], at)
    bulb = shapes.place(
        shapes.sphere("Bulb", 0.04, 24), "Bulb", [materials.glow("Bulb", (1.0, 0.8, 0.55), 4.0)],
        (at[0], at[1], 1.40),
    )  # fmt: skip
    bulb.visible_shadow = False


def _lights() -> None:
    """Small and crisp: the pendant, the lamp's bulb, a soft-coloured fill, and the sun."""
    x, y, _ = TABLE
    spot = _light("Pendant", "SPOT", 95.0, (1.0, 0.84, 0.62))
    spot.data.spot_size, spot.data.spot_blend = 1.9, 0.35
    _aim(spot, (x, y, 1.86), (x, y, 0.0))
    _aim(_light("Lamp", "POINT", 48.0, (1.0, 0.72, 0.42)), (LAMP[0], LAMP[1], 1.40))
    _aim(_light("Fill", "POINT", 105.0, (0.80, 0.88, 1.0)), (1.7, -1.4, 2.35))
    sun = _light("Sun", "SUN", 5.0, (1.0, 0.90, 0.74))
    sun.data.angle = 0.001
    _aim(sun, (-WIDTH / 2 - 2.0, 0.1, 3.0), (-0.25, 0.45, 0.0))


def _light(
    name: str, kind: Literal["POINT", "SPOT", "SUN"], energy: float, color: shapes.Vec
) -> Any:
    """A light object; point and spot lights are bulbs of 6 mm."""
    data: Any = bpy.data.lights.new(name, kind)
    data.energy, data.color = energy, color
    if kind != "SUN":
        data.shadow_soft_size = 0.003
    obj = bpy.data.objects.new(name, data)
    bpy.data.scenes[0].collection.objects.link(obj)
    return obj


def _aim(light: Any, at: shapes.Vec, target: shapes.Vec | None = None) -> None:
    light.location = at
    if target is not None:
        light.rotation_euler = shapes.look_at(at, target)


def _camera(scene: Any) -> None:
    data = bpy.data.cameras.new("Shot")
    data.lens, data.sensor_width = 22.0, 36.0
    camera = bpy.data.objects.new("Shot", data)
    scene.collection.objects.link(camera)
    scene.camera = camera
    for frame, at, target in CAMERA_KEYS:
        camera.location = at
        camera.rotation_euler = shapes.look_at(at, target)
        camera.keyframe_insert("location", frame=frame)
        camera.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(CAMERA_KEYS[0][0])
