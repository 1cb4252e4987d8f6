# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' pictures of written lights against the controls' formulas.

The stage is rendered without the controls, and the picture multiplied by the float64 twin of the
filters at Cycles' own positions. The light is a point, so that there is no noise; one sample goes
through each pixel within 0.005 pixels of its centre. Its place is known no better than that, which
counts where a control's shape is fine: 60 dB of the brightest pixel are asked for, and no pixel a
hundredth off but for those that a hard edge goes through.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.scene.light import Light
from addon.scene.light_controls import (
    BarnDoors,
    Blocker,
    DistanceRange,
    Falloff,
    LightControls,
    Noise,
    Slide,
    Superellipse,
)
from tests.cycles_stage import CyclesStage
from tests.reference.light_filters import light_filters

SIZE = 64


@pytest.fixture(scope="module", params=["POINT", "SPOT"])
def stage(request: Any, tmp_path_factory: pytest.TempPathFactory) -> CyclesStage:
    """Turned, stretched and mirrored, as far as light space can show it."""
    made = CyclesStage(request.param, tmp_path_factory.mktemp("stage"), SIZE)
    made.light.scale = (-1.0, 2.0, 0.7) if request.param == "POINT" else (1.0, 1.3, 0.9)
    made.scene.view_layers[0].update()
    return made


@pytest.fixture(scope="module")
def unwritten(stage: CyclesStage) -> Any:
    return stage.render()


def flag(stage: CyclesStage, location: tuple[float, float, float]) -> Any:
    import bpy

    obj: Any = bpy.data.objects.get("Flag")
    if obj is None:
        obj = bpy.data.objects.new("Flag", None)
        stage.scene.collection.objects.link(obj)
    obj.location, obj.rotation_euler, obj.scale = location, (0.3, 0.2, 0.1), (0.3, 0.2, 1.0)
    stage.scene.view_layers[0].update()
    return obj


def blocker(stage: CyclesStage, **settings: Any) -> Blocker:
    obj = flag(stage, (0.2, -0.4, 1.2))
    outline = Superellipse(0.8, 0.7, 0.6, 0.6, 0.5)
    return Blocker("Flag", np.array(obj.matrix_world, dtype=np.float64), outline, **settings)


def picture(seed: int) -> NDArray[np.float32]:
    """(8, 12, 4) colours, and parts that are transparent."""
    rng = np.random.default_rng(seed)
    return rng.random((8, 12, 4)).astype(np.float32)


SOFT = Superellipse(0.4, 0.3, 0.2, 0.1)
# Each control, and how many pixels its hard edges may flip.
CONTROLS: dict[str, tuple[LightControls, int]] = {
    "soft doors": (LightControls(barn_doors=BarnDoors(SOFT, (0.1, -0.05))), 0),
    "square doors": (
        LightControls(barn_doors=BarnDoors(Superellipse(0.4, 0.3, roundness=0.01), rotation=0.5)),
        8,
    ),
    "star doors": (
        LightControls(
            barn_doors=BarnDoors(Superellipse(0.6, 0.5, 0.3, 0.3, 5.0), density=0.7, invert=True)
        ),
        0,
    ),
    "distance": (LightControls(distance=DistanceRange(1.4, 0.3, 2.3, 0.5)), 0),
    "along axis": (LightControls(distance=DistanceRange(1.5, 0.0, 2.4, 0.3, along_axis=True)), 8),
    "linear": (LightControls(falloff=Falloff(1.0, 2.0)), 0),
    "cubic": (LightControls(falloff=Falloff(3.0, 2.0)), 0),
    "slide": (
        LightControls(
            slide=Slide(picture(1), "A", "SLIDE", 0.8, (0.9, 0.6), (0.1, 0.05), 0.4, frame=False)
        ),
        8,
    ),
    "cookie": (LightControls(slide=Slide(picture(2), "B", scale=(0.3, 0.2), repeat=True)), 0),
    "projected noise": (LightControls(noise=Noise(0.8, 6.0, offset=(1.0, 2.0, 3.0))), 0),
    "solid noise": (LightControls(noise=Noise(1.5, 3.0, 3.5, 0.7, projected=False)), 0),
}


def expected(stage: CyclesStage, unwritten: Any, controls: LightControls) -> Any:
    radiance, position, _ = unwritten
    matrix = np.array(stage.light.matrix_world, dtype=np.float64)
    light = Light("Key", stage.light.data.type, matrix, 1.0, np.ones(3), controls=controls)
    return radiance * light_filters(light, position)


def assert_same(shown: Any, wanted: Any, flips: int) -> None:
    error = np.abs(shown - wanted).max(axis=-1) / wanted.max()
    off = error > 1e-2
    assert np.count_nonzero(off) <= flips
    assert np.sqrt(np.mean(np.where(off, 0.0, error) ** 2)) < 1e-3


@pytest.mark.parametrize("name", CONTROLS)
def test_a_control_looks_the_same_in_cycles(name: str, stage: CyclesStage, unwritten: Any) -> None:
    from addon.ui import write_back

    controls, flips = CONTROLS[name]
    wanted = expected(stage, unwritten, controls)
    # The control does something, and leaves something to compare.
    assert np.abs(wanted - unwritten[0]).max() > 0.1 * wanted.max() > 0.0
    write_back.write(stage.light.data, controls)
    try:
        assert_same(stage.render()[0], wanted, flips)
    finally:
        write_back.remove(stage.light.data)


@pytest.mark.parametrize("invert", [False, True])
def test_a_blocker_follows_its_object(invert: bool, stage: CyclesStage, unwritten: Any) -> None:
    from addon.ui import write_back

    settings: Any = {"density": 0.8, "color": (0.1, 0.2, 0.3), "invert": invert}
    controls = LightControls(blockers=(blocker(stage, **settings),))
    write_back.write(stage.light.data, controls)
    try:
        assert_same(stage.render()[0], expected(stage, unwritten, controls), 0)
        moved = flag(stage, (0.5, -0.2, 1.4))
        card = Blocker(
            "Flag", np.array(moved.matrix_world), controls.blockers[0].outline, **settings
        )
        controls = LightControls(blockers=(card,))
        assert_same(stage.render()[0], expected(stage, unwritten, controls), 0)
    finally:
        write_back.remove(stage.light.data)


def test_controls_multiply(stage: CyclesStage, unwritten: Any) -> None:
    from addon.ui import write_back

    names = ("soft doors", "distance", "linear", "cookie", "solid noise")
    parts = {
        kind: value
        for name in names
        for kind, value in vars(CONTROLS[name][0]).items()
        if value != getattr(LightControls(), kind)
    }
    controls = LightControls(**parts, blockers=(blocker(stage),))
    write_back.write(stage.light.data, controls)
    try:
        assert_same(stage.render()[0], expected(stage, unwritten, controls), 0)
    finally:
        write_back.remove(stage.light.data)


def test_an_area_light_is_shaped_from_its_centre(tmp_path: Path) -> None:
    """Its whole extent sees one pattern: the noise is its own, in both pictures the same."""
    from addon.ui import write_back

    stage = CyclesStage("AREA", tmp_path, SIZE)
    stage.light.data.shape, stage.light.data.size, stage.light.data.size_y = "RECTANGLE", 0.8, 0.3
    unwritten = stage.render(16)
    controls = CONTROLS["soft doors"][0]
    write_back.write(stage.light.data, controls)
    assert_same(stage.render(16)[0], expected(stage, unwritten, controls), 0)
