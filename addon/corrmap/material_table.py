# SPDX-License-Identifier: GPL-3.0-or-later
"""What is one number for all of a material: its constants, its means, its largest albedos."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..caching.framebuffer import DeepFramebuffer
from ..caching.packing import Packing
from .surface_layout import SurfaceLayout


class MaterialTable:
    """The rows of the material table, gathered from deep framebuffers one after another.

    A column is a material of the plan, 1 + its index; the first and the last, for materials that
    the cache does not know, have what most of the cache's texels have.

    Args:
        packing: of the plan; where some of its channels turn out to be wide, `rows` takes another.
        layout: of the surfaces.
    """

    def __init__(self, packing: Packing, layout: SurfaceLayout) -> None:
        self._packing = packing
        self._layout = layout
        self._columns = len(packing.plan.material_names) + 2
        self._counts = np.zeros(self._columns)
        self._sums = np.zeros((len(layout.values), self._columns))
        self._largest = {name: np.zeros(self._columns, dtype=np.float32) for name in packing.scaled}

    @property
    def layout(self) -> SurfaceLayout:
        """Of the surfaces."""
        return self._layout

    @property
    def columns(self) -> int:
        """Materials and two."""
        return self._columns

    def scale_rows(self, packing: Packing) -> dict[str, tuple[int, int]]:
        """Row and component of the scale of each channel in `Packing.scaled`."""
        first = self._layout.scale_row
        return {name: (first + i // 4, i % 4) for i, name in enumerate(packing.scaled)}

    def add(self, framebuffer: DeepFramebuffer) -> None:
        """Take a framebuffer's texels into the means and the scales."""
        hit = framebuffer.channels["depth"].ravel() > 0.0
        ids = self.ids(framebuffer).ravel()[hit]
        self._counts += np.bincount(ids, minlength=self._columns)
        for row, (name, component) in enumerate(self._layout.values):
            values = framebuffer.channels[name][..., component].ravel()[hit]
            self._sums[row] += np.bincount(ids, weights=values, minlength=self._columns)
        for name, largest in self._largest.items():
            values = framebuffer.channels[name].max(axis=-1).ravel()[hit]
            np.maximum.at(largest, ids, values)

    def ids(self, framebuffer: DeepFramebuffer) -> NDArray[np.int64]:
        """(R, R) the column of every texel; 0 where the material is none of the plan's."""
        count = self._columns - 2
        side = framebuffer.camera.resolution
        if "material_id" not in self._packing.stored:
            constant = self._packing.plan.constant("material_id") or (0.0,)
            return np.full((side, side), min(int(constant[0]), count))
        ids = np.rint(framebuffer.channels["material_id"][..., 0]).astype(np.int64)
        return np.where((ids < 0) | (ids > count), 0, ids)

    def scale(self, framebuffer: DeepFramebuffer) -> dict[str, NDArray[np.float32]]:
        """For each name in `Packing.scaled`, (R, R): the largest value of each texel's material.

        Of the framebuffers that were added, of which this must be one.
        """
        ids = self.ids(framebuffer)
        return {name: largest[ids] for name, largest in self._largest.items()}

    def rows(self, packing: Packing, added: MaterialTable | None = None) -> NDArray[np.float32]:
        """(rows, columns, 4): means of the values, constants, and the scales of `packing`.

        With `added`, of framebuffers that came later, their scales behind these; and the means of
        materials that were not seen before are theirs.
        """
        means = self._means(added)
        plan = self._packing.plan
        constants = np.zeros((len(self._layout.constants), self._columns))
        usual = int(np.argmax(self._counts[1:-1])) if self._columns > 2 else 0
        for row, (name, component) in enumerate(self._layout.constants):
            every = [value[component] for value in plan.material_constants[name]]
            constants[row] = [every[usual], *every, every[usual]]
        # What the cache does not know is taken for something without bumps.
        of_mesh = [[1.0, *plan.mesh_normals[name], 1.0] for name in self._layout.mesh_normals]
        flags = np.reshape(of_mesh, (-1, self._columns))
        parts = [means, constants, flags, self.scales(packing)]
        if added is not None:
            parts.append(added.scales(packing))
        rows = np.concatenate([_in_fours(part) for part in parts])
        # A texture has a row at least.
        return rows if len(rows) else np.zeros((1, self._columns, 4), dtype=np.float32)

    def scales(self, packing: Packing) -> NDArray[np.floating]:
        """(N, columns) the largest values of each channel in `packing.scaled`."""
        scales = np.array([self._largest[name] for name in packing.scaled], dtype=np.float32)
        return scales.reshape(-1, self._columns)

    @property
    def sums(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(columns,) texels of each material, and (values, columns) what their values add up to."""
        return self._counts, self._sums

    def _means(self, added: MaterialTable | None) -> NDArray[np.float64]:
        overall = self._sums.sum(axis=1, keepdims=True) / max(float(self._counts.sum()), 1.0)
        counts, sums = self.sums
        if added is not None:
            counts, sums = (
                np.where(self._counts > 0.0, mine, theirs)
                for mine, theirs in zip(self.sums, added.sums, strict=True)
            )
        means = np.where(counts > 0.0, sums / np.maximum(counts, 1.0), overall)
        means[:, [0, -1]] = overall
        return means


def _in_fours(rows: NDArray[np.floating]) -> NDArray[np.float32]:
    """(N / 4, columns, 4) of (N, columns)."""
    count, columns = rows.shape
    padded = np.zeros((-(-count // 4) * 4, columns), dtype=np.float32)
    padded[:count] = rows
    return padded.reshape(-1, 4, columns).transpose(0, 2, 1)
