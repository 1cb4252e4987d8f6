# SPDX-License-Identifier: GPL-3.0-or-later
"""What a surface edit cannot reach, because the cache holds nothing that it could change.

An edit multiplies what is cached. What was black everywhere in a material when it was baked is
either not in the cache or stays black.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from ..scene.geometry import SceneGeometry
from ..scene.surface_edit import WHITE, SurfaceEdit, SurfaceEdits
from .channels import CHANNEL_BY_NAME, lobe_channel
from .plan import ChannelPlan

# A reflectance that agrees up to 8 bits; see surface_edit.glsl.
_SAME = 1.0 / 256.0

# The mean of a stored channel's values over a material; None where nobody knows.
Means = Callable[[int, str], NDArray[np.float64] | None]


def _no_means(_material: int, _channel: str) -> None:
    return None


def out_of_reach(
    plan: ChannelPlan,
    edits: SurfaceEdits,
    means: Means = _no_means,
    materials_of: Mapping[str, Collection[str]] | None = None,
) -> tuple[str, ...]:
    """A sentence for each edit that shows nothing, or less than it says.

    Args:
        plan: of the cache.
        edits: of the scene.
        means: gives of a material (an index into the plan's) and a stored channel the mean over
            its texels, which of colours tells whether they are black everywhere.
        materials_of: the names of the materials on the objects of a name; nothing is said of
            objects that are not in it.
    """
    index = {name: number for number, name in enumerate(plan.material_names)}
    found: list[str] = []
    for name, edit in edits.materials.items():
        if edit.is_neutral:
            continue
        if name not in index:
            found.append(f"material '{name}': its edits do nothing, as it is not in the cache")
            continue
        reached = _Material(plan, index[name], means)
        found += [f"material '{name}': {text}" for text in reached.limits(edit)]
    for name, edit in edits.objects.items():
        if edit.is_neutral or materials_of is None or name not in materials_of:
            continue
        # What one of its materials shows is no limit of the object.
        known = [index[m] for m in materials_of[name] if m in index]
        each = [dict.fromkeys(_Material(plan, m, means).limits(edit)) for m in known]
        if each and len(known) == len(materials_of[name]):
            shared = [text for text in each[0] if all(text in other for other in each)]
            found += [f"object '{name}': {text}" for text in shared]
    return tuple(found)


def materials_on(geometry: SceneGeometry, names: Iterable[str]) -> dict[str, frozenset[str]]:
    """The names of the materials on the objects of each name."""
    result = {}
    for name in names:
        ids = [index for index, other in enumerate(geometry.object_names) if other == name]
        used = np.unique(geometry.material_id[np.isin(geometry.object_id, ids)])
        result[name] = frozenset(geometry.material_names[material] for material in used)
    return result


class _Material:
    """What the cache holds of one material.

    Of each channel the bounds are known between which its values lie: of a constant both are it,
    of what varies they are 0 and infinity, or 0 where its mean is.
    """

    def __init__(self, plan: ChannelPlan, index: int, means: Means) -> None:
        self._plan = plan
        self._index = index
        self._means = means

    def limits(self, edit: SurfaceEdit) -> Iterator[str]:
        """What of an edit does nothing, or less than it says."""
        colors = self._most_color()
        if edit.color_factor != WHITE:
            yield from _limit_of_color(edit, colors)
        if not self._glossy():
            parts = {
                "roughness": (edit.roughness, edit.roughness_offset) != (1.0, 0.0),
                "specular": edit.specular_factor != WHITE,
            }
            wanted = " and ".join(name for name, used in parts.items() if used)
            if wanted:
                verb = "do" if " and " in wanted else "does"
                yield (
                    f"{wanted} {verb} nothing, as it was baked without gloss; give its shader "
                    "some and bake again"
                )
        else:
            yield from self._limits_of_gloss(edit)
        if edit.emission != 1.0 and not self._largest("emission").any():
            yield "emission does nothing, as it was baked without any; bake it glowing"

    def _limits_of_gloss(self, edit: SurfaceEdit) -> Iterator[str]:
        kept = [self._constant("roughness", lobe) for lobe in self._glossy()]
        # What varies may reach an end anywhere; nothing is said of it.
        known = np.array([value[0] for value in kept if value is not None])
        after = known * edit.roughness + edit.roughness_offset
        if known.size == len(kept):
            if (after < 0.0).any():
                yield "its roughness ends at 0"
            if (after > 1.0 + 1e-6).any():
                yield "its roughness ends at 1"
            if edit.roughness != 1.0 and edit.roughness_offset == 0.0 and not known.any():
                yield "a factor does nothing to its roughness of 0; add an offset"
        strongest = max(edit.specular_factor)
        layers = [
            (self._constant("layer_f0", lobe), self._constant("layer_f90", lobe))
            for lobe in self._glossy()
        ]
        if strongest > 1.0 and any(
            f0 is not None and f90 is not None and f0[0] * strongest > f90[0] > 0.0
            for f0, f90 in layers
        ):
            yield "the reflectance of its gloss ends at 1"

    def _glossy(self) -> list[int]:
        """Numbers of the lobes that may have gloss."""
        lobes = range(1, self._plan.lobes + 1)
        return [lobe for lobe in lobes if self._largest("specular_f90", lobe).any()]

    def _most_color(self) -> NDArray[np.float64]:
        """(3,) the most of red, green and blue that gain and tint multiply."""
        most = np.zeros(3)
        for field in ("diffuse_color", "translucent_color", "sheen_color"):
            most = np.maximum(most, self._most(field))
        for lobe in self._glossy():
            if not self._is_dielectric(lobe):
                most = np.maximum(most, self._largest("specular_f0", lobe))
        return most

    def _is_dielectric(self, lobe: int) -> bool:
        """Whether all gloss of a lobe is a dielectric's, which is for the specular edit."""
        names = ("specular_f90", "dielectric", "layer_f90")
        f90, share, layer = (self._constant(name, lobe) for name in names)
        if f90 is None or share is None or layer is None:
            return False
        covered = share * layer
        return bool((f90 - covered <= _SAME * covered).all())

    def _most(self, field: str) -> NDArray[np.float64]:
        lobes = range(1, self._plan.lobes + 1)
        return np.asarray(np.max([self._largest(field, lobe) for lobe in lobes], axis=0))

    def _largest(self, field: str, lobe: int = 1) -> NDArray[np.float64]:
        """(components,) an upper bound of a channel whose values are not negative."""
        constant = self._constant(field, lobe)
        if constant is not None:
            return constant
        name = self._stored(field, lobe)
        mean = self._means(self._index, name)
        full = np.full(CHANNEL_BY_NAME[name].components, np.inf)
        return full if mean is None else np.where(mean > 0.0, full, 0.0)

    def _constant(self, field: str, lobe: int = 1) -> NDArray[np.float64] | None:
        """A channel's value in this material; None where it varies."""
        name = field if field == "emission" else lobe_channel(field, lobe)
        every = self._plan.material_constants.get(name)
        value = every[self._index] if every is not None else self._plan.constant(name)
        return None if value is None else np.array(value, dtype=np.float64)

    def _stored(self, field: str, lobe: int) -> str:
        name = field if field == "emission" else lobe_channel(field, lobe)
        return self._plan.same.get(name, name)


def _limit_of_color(edit: SurfaceEdit, most: NDArray[np.float64]) -> Iterator[str]:
    if not most.any():
        yield (
            "gain and tint do nothing, as its colours were black when it was baked; give it a "
            "colour and bake again"
        )
        return
    for name, value, factor in zip(("red", "green", "blue"), most, edit.tint, strict=True):
        if value == 0.0 and factor > min(edit.tint):
            yield f"its colours have no {name} that a tint could show"
