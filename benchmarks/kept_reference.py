# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' picture of a view, kept in a folder between runs and made finer when it is too noisy."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from addon.progress import Progress, part_of
from addon.whole_file import replacing
from tools import metrics
from tools.evaluation import SEED_STRIDE
from tools.reference import Halves, Reference, render_reference

# Pixels along the side of what may be rendered finer, and how many times the samples it takes.
BLOCK, FINER = 16, 16
# Of a picture's error.
_LARGE_SHARE = 0.02

_NAMES = ("half 0", "half 1", "depth", "objects")


class Block(NamedTuple):
    """BLOCK x BLOCK pixels, less at the picture's end: its lowest row and first column."""

    row: int
    column: int


class KeptReference:
    """A reference of one view of one scene.

    Attributes:
        picture: the EXR that holds it.
        finer: blocks that were rendered with more samples.

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
        self.finer: list[Block] = []
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

    def finer_blocks(self, image: NDArray[np.floating], most: int) -> list[Block]:
        """Blocks that hold more than their share of what a picture is off, the worst first.

        A mirror image of a lamp on thin trim may fill a thousandth of a pixel and be ten thousand
        times as bright as all else: most of Cycles' samples miss it, in both renders, and nothing
        in their noise tells. Blocks that were made finer already are left out.

        Args:
            image: (H, W, 3) the relit picture, scene-linear.
            most: how many at most.
        """
        held = self._held()
        encoded = [metrics.encode_srgb(p[..., :3]) * 255.0 for p in (image, held.rgba)]
        _, error = metrics.squared_error(*encoded)
        rows, columns = (-(-length // BLOCK) for length in error.shape)
        padded = np.pad(
            error,
            [
                (0, n * BLOCK - length)
                for n, length in zip((rows, columns), error.shape, strict=True)
            ],
        )
        sums = padded.reshape(rows, BLOCK, columns, BLOCK).sum(axis=(1, 3)).ravel()
        order = [int(n) for n in np.argsort(-sums) if sums[n] > _LARGE_SHARE * sums.sum()]
        blocks = [Block(n // columns * BLOCK, n % columns * BLOCK) for n in order[:most]]
        return [block for block in blocks if block not in self.finer]

    def refine(self, scene: Any, camera: Any, blocks: Sequence[Block], progress: Progress) -> None:
        """Render blocks anew with many more samples, which take the place of those before."""
        for number, block in enumerate(blocks):
            step = part_of(progress, number / len(blocks), (number + 1) / len(blocks))
            samples = FINER * self.samples
            held = self._held()
            height, width = held.depth.shape
            ends = min(block.row + BLOCK, height), min(block.column + BLOCK, width)
            with _only(scene, block, ends, (height, width)):
                # Seeds of other renders are all below; see `_render`.
                seed = (2 * self.samples + number + 1) * SEED_STRIDE
                new = _summed(render_reference(scene, camera, samples, step, first_seed=seed))
            inside = np.s_[block.row : ends[0], block.column : ends[1]]
            for old, found in zip(held.base, new.base, strict=True):
                old[inside] = found
            self.finer.append(block)
        if blocks:
            self._write_picture()
            self._save()

    def noise(self, mask: NDArray[np.bool_] | None = None) -> float | None:
        """PSNR of its luma against the noiseless picture, decibels, estimated."""
        return self._held().noise_floor(mask)["psnr_luma"]

    def noiseless_psnr(
        self, image: NDArray[np.floating], mask: NDArray[np.bool_] | None = None
    ) -> float | None:
        """Of a relit picture's luma against the noiseless picture, decibels, estimated."""
        return self._held().noiseless_psnr(image, mask)

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
        self.finer = []
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
            "finer": np.array(self.finer, dtype=np.int64).reshape(-1, 2),
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
            if "finer" in file:
                self.finer = [Block(int(row), int(column)) for row, column in file["finer"]]


@contextmanager
def _only(scene: Any, block: Block, ends: tuple[int, int], size: tuple[int, int]) -> Iterator[None]:
    """Renders of a part of the picture alone."""
    render = scene.render
    render.use_border = render.use_crop_to_border = True
    # An end before a beginning that is there from another block would not be taken.
    render.border_min_x = render.border_min_y = 0.0
    render.border_max_x = render.border_max_y = 1.0
    # Blender rounds down; a quarter of a pixel keeps its float32 from the next lower one.
    render.border_min_x = (block.column + 0.25) / size[1]
    render.border_max_x = min((ends[1] + 0.25) / size[1], 1.0)
    render.border_min_y = (block.row + 0.25) / size[0]
    render.border_max_y = min((ends[0] + 0.25) / size[0], 1.0)
    try:
        yield
    finally:
        render.use_border = render.use_crop_to_border = False


def _summed(reference: Reference) -> Reference:
    """The same with all lights in one layer: a tenth of the disk for a scene of many lights."""
    halves: Halves = (
        reference.half(0).astype(np.float32),
        reference.half(1).astype(np.float32),
    )
    return Reference(
        halves, {}, reference.depth, reference.objects, reference.pixel, reference.perspective
    )
