# SPDX-License-Identifier: GPL-3.0-or-later
"""Highlights on tubes two pixels wide: few samples beside very many, each a picture of its own."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.plan import ChannelPlan
from addon.scene.geometry import SceneGeometry
from addon.scene.light import Light
from tests import synthetic
from tests.corrmap.test_own_hits import tube

from .test_session import MemoryStore, white

pytestmark = pytest.mark.usefixtures("gpu_context")

KEY = replace(
    Light("Key", "AREA", synthetic.looking_at((-2.0, -3.5, 1.5), (0, 0, 0)), 100.0, np.ones(3)),
    size=0.4,
    use_shadow=False,
)


def store(geometry: SceneGeometry) -> MemoryStore:
    """A metal tube before a wall without highlights."""
    plan = ChannelPlan(
        ("depth", "material_id", "normal", "diffuse_color"), {}, geometry.material_names,
        material_constants={
            "specular_f0": ((0.9, 0.9, 0.9), (0.0, 0.0, 0.0)),
            "specular_f90": ((1.0, 1.0, 1.0), (0.0, 0.0, 0.0)),
            "roughness": ((0.3,), (1.0,)),
        },
        mesh_normals={"normal": (True, True)},
    )  # fmt: skip
    cameras = [
        replace(camera, id=number)
        for number, camera in enumerate(synthetic.cube_cameras((0.0, -4.0, 0.0), 128))
    ]
    tracer = synthetic.Tracer(geometry)
    return MemoryStore(
        plan, [synthetic.trace_framebuffer(geometry, tracer, c, white) for c in cameras]
    )


def rendered(geometry: SceneGeometry, samples: int, visibility: int) -> NDArray[np.float64]:
    """(H, W, 3)."""
    from addon.relight.session import RelightSession

    session = RelightSession(geometry, cast("Any", store(geometry)), samples, visibility=visibility)
    session.set_world(None)
    session.set_view(
        synthetic.perspective_view(
            synthetic.looking_at((0.3, -4.0, 0.2), (0.0, 0.0, 0.0)), 32, 24, 0.9
        )
    )
    session.set_lights([KEY])
    return session.render().combined[..., :3].astype(np.float64)


def error(got: NDArray[np.float64], want: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean((got - want) ** 2)))


def test_few_samples_find_the_highlight(monkeypatch: pytest.MonkeyPatch) -> None:
    geometry = tube(0.12)
    got = rendered(geometry, 16, 64)
    with monkeypatch.context() as patch:
        # The truth, and what comes of lobes as narrow as the material says.
        patch.setattr("addon.corrmap.pixel_bend.DEVIATION", 0.0)
        want = rendered(geometry, 400, 0)
        patch.setattr("addon.corrmap.bent_surfaces.BentSurfaces.of", lambda *_: None)
        plain = rendered(geometry, 16, 64)
    assert want.max() > 5.0 * np.median(want)
    # Three eighths of it as measured.
    assert error(got, want) < 0.5 * error(plain, want)
    # Nine hundredths of it as measured; a tenth with one wide lobe of GGX.
    assert error(got, want) < 0.1 * want.std()
    # All of the light is there.
    assert got.mean() == pytest.approx(want.mean(), rel=0.02)
