# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' picture of a view, kept in a folder between runs and made finer when it is too noisy."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.progress import Progress
from addon.whole_file import replacing
from tools import metrics
from tools.evaluation import SEED_STRIDE
from tools.reference import Halves, Reference, render_reference

_NAMES = ("half 0", "half 1", "depth", "objects")


class KeptReference:
    """A reference of one view of one scene.

    Attributes:
        picture: the EXR that holds it.

    Args:
        folder: of the view.
        key: of everything that it depends on; what was kept under another one is rendered anew.
        samples: of a pixel for each light, to begin with.
    """

    def __init__(self, folder: Path, key: str, samples: int) -> None:
        self._folder, self._key, self._first = folder, key, samples
        self._reference: Reference | None = None
        self.picture = folder / "reference.exr"
        self.samples, self._seconds = 0, 0.0
        self._load()

    @property
    def doublings(self) -> int:
        """How often the samples were doubled."""
        return (self.samples // self._first).bit_length() - 1

    def require(self, scene: Any, camera: Any, progress: Progress) -> None:
        """Render it, if it was not yet; the scene is prepared for references."""
        if self._reference is None:
            self._render(scene, camera, self._first, progress)
        elif not self.picture.is_file():
            self._write_picture()

    def double(self, scene: Any, camera: Any, progress: Progress) -> None:
        """Take as many samples again."""
        self._render(scene, camera, self.samples, progress)

    def noise(self, mask: NDArray[np.bool_] | None = None) -> float | None:
        """PSNR of its luma against the noiseless picture, decibels, estimated."""
        return self._held().noise_floor(mask)["psnr_luma"]

    def flip_noise(self) -> float:
        """HDR-FLIP that its noise alone is good for, estimated.

        Its two halves differ by twice what their mean is off, and FLIP is about linear in small
        differences.
        """
        halves = [half[..., :3] for half in self._held().base]
        return 0.5 * float(metrics.flip_map(halves[0], halves[1], linear=True).mean())

    def write_png(self, scene: Any) -> None:
        """Leave a picture to look at."""
        from tools.display import write_display_png

        write_display_png(scene, self._held().rgba, self._folder / "reference.png")

    def _held(self) -> Reference:
        if self._reference is None:
            raise RuntimeError("require the reference first")
        return self._reference

    def _render(self, scene: Any, camera: Any, samples: int, progress: Progress) -> None:
        started = time.monotonic()
        # Seeds of earlier renders are all below the number of samples times the stride.
        seed = self.samples * SEED_STRIDE
        new = _summed(render_reference(scene, camera, samples, progress, first_seed=seed))
        self._reference = new if self._reference is None else self._reference.joined(new)
        self.samples += samples
        self._seconds += time.monotonic() - started
        self._folder.mkdir(parents=True, exist_ok=True)
        self._write_picture()
        self._save()

    def _write_picture(self) -> None:
        self._held().write(self.picture)

    def _save(self) -> None:
        held = self._held()
        arrays = dict(zip(_NAMES, (*held.base, held.depth, held.objects), strict=True))
        numbers = {
            "key": self._key, "samples": self.samples, "seconds": self._seconds,
            "pixel": held.pixel, "perspective": held.perspective,
        }  # fmt: skip
        with (
            replacing(self._folder / "reference.npz") as part,
            part.open("wb") as file,
        ):
            np.savez_compressed(file, **arrays, **numbers)  # type: ignore[arg-type]

    def _load(self) -> None:
        path = self._folder / "reference.npz"
        if not path.is_file():
            return
        with np.load(path) as file:
            if str(file["key"]) != self._key:
                return
            halves: Halves = (file["half 0"], file["half 1"])
            self._reference = Reference(
                halves, {}, file["depth"], file["objects"], float(file["pixel"]),
                bool(file["perspective"]),
            )  # fmt: skip
            self.samples, self._seconds = int(file["samples"]), float(file["seconds"])


def _summed(reference: Reference) -> Reference:
    """The same with all lights in one layer: a tenth of the disk for a scene of many lights."""
    halves: Halves = (
        reference.half(0).astype(np.float32),
        reference.half(1).astype(np.float32),
    )
    return Reference(
        halves, {}, reference.depth, reference.objects, reference.pixel, reference.perspective
    )
