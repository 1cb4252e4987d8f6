# SPDX-License-Identifier: GPL-3.0-or-later
"""The glowing objects of a session: which of them light the current view."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...corrmap.surface_sampler import SurfaceSampler
from ...errors import InputError
from ...glsl.shader import read_texture
from ...scene.light import Light
from ...scene.light_linking import UNLINKED, LightLinking
from ...scene.mesh_light import MeshLight
from ...scene.surface_edit import NO_EDITS, SurfaceEdits
from .mesh_lights import LEAST_SHARE, Glow, glow, mesh_lights, shares

# A light that is there stays until it has fallen to this part of what it takes to come: layers
# should not come and go while the camera moves.
_STAYS = 0.25


class GlowingObjects:
    """Makes lights of objects that glow, and leaves out those that hardly light the view.

    Args:
        sampler: whose cache says what glows, and whose geometry where. Needs a GPU context.
    """

    def __init__(self, sampler: SurfaceSampler) -> None:
        self._sampler = sampler
        pages = sampler.pages
        self._layout = pages.surface_layout
        self._baked = glow(self._layout.plan, self._layout, read_texture(pages.material_table))
        self._edits = NO_EDITS
        self._linking: Mapping[str, LightLinking] = {}
        self._solo: frozenset[str] = frozenset()
        self._mute: frozenset[str] = frozenset()
        self._all: tuple[MeshLight, ...] | None = None
        self._chosen: tuple[MeshLight, ...] = ()

    def forget(self) -> None:
        """Objects moved or changed their shape."""
        self._all = None

    def set_edits(self, edits: SurfaceEdits) -> None:
        """Surfaces were edited: what they send out, too."""
        if edits != self._edits:
            self._edits = edits
            self._all = None

    def set_linking(self, linking: Mapping[str, LightLinking]) -> bool:
        """Link objects, by name, to others where they glow; False when they are already."""
        if linking == self._linking:
            return False
        self._linking = dict(linking)
        self._all = None
        return True

    def set_mix(self, solo: Collection[str], mute: Collection[str]) -> None:
        """Show only the light of some objects, or leave that of some out; by their names.

        Raises:
            InputError: one of them does not glow.
        """
        known = [light.name for light in self._lights()]
        for name in (*solo, *mute):
            if name not in known:
                some = ", ".join(f"'{name}'" for name in known) or "none"
                raise InputError(f"object '{name}' does not glow; those that do are: {some}")
        self._solo, self._mute = frozenset(solo), frozenset(mute)
        self._all = None

    def choose(
        self,
        lights: Sequence[Light],
        receivers: NDArray[np.float64],
        reached: Callable[[Light], NDArray[np.float64]],
    ) -> tuple[MeshLight, ...]:
        """The glowing objects that light a view.

        Args:
            lights: the scene's other lights; those that are mute outshine nothing.
            receivers: (N, 3) world space: places that the view sees.
            reached: gives for a light (N,) which share of it reaches each of these.
        """
        glowing = self._lights()
        taken = {light.name for light in lights}
        audible = [light for light in lights if not light.mute]
        share = shares(glowing, audible, receivers, reached)
        there = {light.name for light in self._chosen}
        self._chosen = tuple(
            light
            for light, part in zip(glowing, share, strict=True)
            if light.name not in taken
            and (light.solo or part >= LEAST_SHARE * (_STAYS if light.name in there else 1.0))
        )
        return self._chosen

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for each thing about them that is not modelled, or left out."""
        there = {light.name for light in self._chosen}
        out = [light.name for light in self._all or () if light.name not in there]
        said = [sentence for light in self._chosen for sentence in light.warnings]
        if out:
            names = ", ".join(f"'{name}'" for name in out[:3])
            more = f" and {len(out) - 3} more" if len(out) > 3 else ""
            said.append(
                f"glowing objects that give less than {100.0 * LEAST_SHARE:g} % of the light in "
                f"this view light nothing: {names}{more}"
            )
        return tuple(said)

    def _lights(self) -> tuple[MeshLight, ...]:
        """All that glow."""
        if self._all is None:
            factors = {name: edit.emission for name, edit in self._edits.objects.items()}
            self._all = tuple(
                replace(
                    light,
                    linking=self._linking.get(light.name, UNLINKED),
                    solo=light.name in self._solo,
                    mute=light.name in self._mute,
                )
                for light in mesh_lights(self._sampler.geometry, self._edited(), factors)
            )
        return self._all

    def _edited(self) -> Glow:
        factors = np.ones((len(self._baked.radiance), 1))
        for index, name in enumerate(self._layout.plan.material_names):
            edit = self._edits.materials.get(name)
            if edit is not None:
                factors[index] = edit.emission
        return Glow(self._baked.radiance * factors, self._baked.varies)
