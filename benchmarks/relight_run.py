# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of `benchmarks.relight` that run as processes of their own.

Each prints one line of JSON.

    python -m benchmarks.relight_run scene TRIANGLES LIGHTS SCENE.blend
    python -m benchmarks.relight_run edits SCENE.blend CACHE WxH RUNS map|traced FOLDER
    python -m benchmarks.relight_run cycles SCENE.blend WxH SAMPLES,... FOLDER
    python -m benchmarks.relight_run truth SCENE.blend WxH SAMPLES FOLDER
    python -m benchmarks.relight_run eevee SCENE.blend WxH SAMPLES,...
    python -m benchmarks.relight_run errors FOLDER
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from addon.relight.session import RelightSession
    from addon.scene.light import Light

# What every renderer is shown: the key light here, and a little brighter.
KEY_SHIFT = (0.6, -0.4, 0.3)
TRUTH = "truth.exr"


def scene(triangles: str, lights: str, out: str) -> dict[str, Any]:
    """Make the scene."""
    from .heads_scene import build

    return {"triangles": build(int(triangles), int(lights), Path(out))}


def edits(  # noqa: PLR0917 - the words of one command line
    scene_path: str, cache: str, size: str, runs: str, shadows: str, folder: str
) -> dict[str, Any]:
    """Median seconds from an edit of the key light to its picture, in a running session.

    The key light moves to and fro: its shadow and its layer are new every time, and a pixel of
    the picture is read back, so that the GPU has surely drawn it. The picture after an edit, and
    the refined one, are written to FOLDER, with the key light where the other renderers see it.
    """
    from tools.picture_file import write_exr
    from tools.relit import open_session, read_scene, read_views

    opened = _open(scene_path)
    arrays = read_scene(opened)
    started = time.perf_counter()
    session = open_session(arrays, Path(cache), 16, shadows=shadows)  # type: ignore[arg-type]
    loaded = time.perf_counter() - started
    (view,) = read_views(opened, [None], _size(size))
    session.set_view(view)
    desk = LightDesk(session, arrays.lights)
    started = time.perf_counter()
    desk.full_picture()
    first_view = time.perf_counter() - started
    # Refined to the end, so that edits are timed against a still picture.
    desk.refine()
    shifts = [0.01 * (k + 1) for k in range(int(runs) + 2)]
    coarse = _medians(desk.coarse_edit, shifts)
    shape = _medians(desk.full_edit, shifts)
    desk.refine()
    color = _medians(desk.color_edit, [1.0 + shift for shift in shifts])
    desk.refine()
    desk.full_edit(1.0)
    write_exr(Path(folder) / f"relume-{shadows}-1.exr", desk.picture())
    desk.move(1.0)
    refined = desk.refine()
    write_exr(Path(folder) / f"relume-{shadows}-16.exr", desk.picture())
    return {
        "triangles": len(arrays.geometry),
        "lights": len(arrays.lights),
        "load_s": loaded,
        "first_view_s": first_view,
        "coarse_s": coarse,
        "shape_s": shape,
        "color_s": color,
        "refined_s": refined,
    }


class LightDesk:
    """Edits a session's key light and waits for the pictures.

    Args:
        session: with a view.
        lights: its lights, one of which is "Key".
    """

    def __init__(self, session: RelightSession, lights: Sequence[Light]) -> None:
        from addon.relight.layers.fence import Fence

        self._session = session
        self._fence = Fence()
        self._lights = {light.name: light for light in lights}
        self._key = self._lights["Key"]

    def move(self, share: float) -> None:
        """Put the key light at a share of the way to where other renderers see it."""
        moved = self._key.world_from_light.copy()
        moved[:3, 3] += np.array(KEY_SHIFT) * share
        self._set(replace(self._lights["Key"], world_from_light=moved))

    def coarse_edit(self, share: float) -> None:
        """Move it; whatever is shown first."""
        self.move(share)
        self._session.step()
        self._wait()

    def full_edit(self, share: float) -> None:
        """Move it; one sample at every pixel, over what the other lights show."""
        self.move(share)
        self.full_picture()

    def color_edit(self, factor: float) -> None:
        """Make it so many times brighter than it was at first."""
        self._set(replace(self._lights["Key"], energy=self._key.energy * factor))
        self._wait()

    def full_picture(self) -> None:
        """Draw until nothing is coarse."""
        while self._session.shown_stride != 1:
            self._session.step()
        self._wait()

    def refine(self) -> dict[str, float]:
        """Draw all samples; the seconds until some numbers of them were there."""
        seconds: dict[str, float] = {}
        started = time.perf_counter()
        while self._session.step():
            done = self._session.samples_done
            if done.bit_count() == 1 and str(done) not in seconds:
                self._wait()
                seconds[str(done)] = time.perf_counter() - started
        return seconds

    def picture(self) -> NDArray[np.float32]:
        """(H, W, 4) what is shown."""
        from addon.glsl.shader import read_texture

        return read_texture(self._session.draw_combined())

    def _set(self, key: Light) -> None:
        self._lights["Key"] = key
        self._session.set_lights([*self._lights.values()])

    def _wait(self) -> None:
        """Draw the sum, and wait until the GPU has done so."""
        self._fence.wait(self._session.draw_combined())


def cycles(scene_path: str, size: str, samples: str, folder: str) -> dict[str, Any]:
    """Seconds of renders after an edit of the key light, with what Cycles keeps between them."""
    opened = _prepared(scene_path, size)
    opened.render.use_persistent_data = True
    opened.cycles.samples = 1
    _render(opened)  # builds what is kept
    seconds = {}
    for count in map(int, samples.split(",")):
        opened.cycles.samples = count
        opened.objects["Key"].data.energy *= 1.000001
        out = Path(folder) / f"cycles-{count}.exr"
        started = time.perf_counter()
        _render(opened, out)
        seconds[str(count)] = time.perf_counter() - started
    return {"seconds": seconds}


def truth(scene_path: str, size: str, samples: str, folder: str) -> dict[str, Any]:
    """The reference: each light alone, with so many samples."""
    from addon.progress import silent
    from tools import reference

    opened = _prepared(scene_path, size)
    made = reference.render_reference(opened, opened.camera, int(samples), silent)
    made.write(Path(folder) / TRUTH)
    return {"noise_floor": made.noise_floor()}


def eevee(scene_path: str, size: str, samples: str) -> dict[str, Any]:
    """Seconds of EEVEE's renders with its shadows, by samples."""
    opened = _prepared(scene_path, size)
    opened.render.engine = "BLENDER_EEVEE"
    opened.eevee.use_raytracing = False
    opened.eevee.taa_render_samples = 1
    _render(opened)  # compiles its shaders
    seconds = {}
    for count in map(int, samples.split(",")):
        opened.eevee.taa_render_samples = count
        times = []
        for _ in range(3 if count == 1 else 1):
            opened.objects["Key"].data.energy *= 1.000001
            started = time.perf_counter()
            _render(opened)
            times.append(time.perf_counter() - started)
        seconds[str(count)] = float(np.median(times))
    return {"seconds": seconds}


def errors(folder: str) -> dict[str, Any]:
    """PSNR of every picture in FOLDER against the reference there."""
    from tools.comparison import compare_pictures
    from tools.picture_file import read_picture

    reference = read_picture(Path(folder) / TRUTH)
    psnr = {}
    for path in sorted(Path(folder).glob("*.exr")):
        if path.name != TRUTH:
            report = compare_pictures(reference, read_picture(path)).report
            psnr[path.stem] = {
                "whole": report["whole"]["psnr_luma"],
                "away": report["away_from_edges"]["psnr_luma"],
            }
    return psnr


def _open(scene_path: str) -> Any:
    from tools.scene_file import load_blender, open_scene

    load_blender()
    return open_scene(Path(scene_path))


def _prepared(scene_path: str, size: str) -> Any:
    """The scene for direct light only, with the key light where all renderers see it."""
    from tools import reference

    opened = _open(scene_path)
    key = opened.objects["Key"]
    key.location = [at + shift for at, shift in zip(key.location, KEY_SHIFT, strict=True)]
    reference.prepare(opened)
    opened.render.resolution_x, opened.render.resolution_y = _size(size)
    opened.render.resolution_percentage = 100
    opened.cycles.use_adaptive_sampling = False
    return opened


def _render(opened: Any, out: Path | None = None) -> None:
    import bpy

    opened.render.image_settings.file_format = "OPEN_EXR"
    opened.render.image_settings.color_depth = "32"
    opened.render.filepath = str(out) if out is not None else ""
    bpy.ops.render.render(write_still=out is not None)


def _size(size: str) -> tuple[int, int]:
    width, height = map(int, size.split("x"))
    return width, height


def _medians(act: Callable[[float], None], values: list[float]) -> float:
    """Median seconds; the first two times, when shaders compile and sums are built, do not
    count."""
    times = []
    for value in values:
        started = time.perf_counter()
        act(value)
        times.append(time.perf_counter() - started)
    return float(np.median(times[2:]))


STEPS = {step.__name__: step for step in (scene, edits, cycles, truth, eevee, errors)}


def main() -> None:
    """Run one step."""
    name, *words = sys.argv[1:]
    print(json.dumps(STEPS[name](*words)))  # type: ignore[operator]


if __name__ == "__main__":
    main()
