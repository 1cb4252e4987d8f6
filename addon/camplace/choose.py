# SPDX-License-Identifier: GPL-3.0-or-later
"""The greedy choice of cameras by what they really add for what they cost."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..progress import Progress
from .aim import cube_cameras, needed_resolution
from .budget import Budget
from .camera import CachingCamera
from .candidates import Candidates
from .coverage import gain, joined, seen_by_camera
from .keep import kept_groups, least_missed
from .offer import Choice, Group, Offer
from .places import Proposer, Sights, fixed_places
from .prepare import Stage
from .settings import RESOLUTIONS, PlacementSettings
from .spheres import Spheres

# An earlier camera is given up for another only if that raises the score by as many least gains:
# it is baked already, and pictures that change for nothing are worse than a little less sharp.
SWAP = 10.0
# Where texels are counted, a picture is taken to cost this many besides its own when choices are
# compared: each move of the view asks every picture about every pixel, however coarse it is.
# Otherwise dozens of the smallest pictures would always come first.
OVERHEAD = 512**2
# Places that are tried for cubes: those that see the most.
CUBES = 16

Stop = Literal["budget", "gain"]


@dataclass(frozen=True)
class Chosen:
    """What was chosen, and why no more.

    Attributes:
        groups: cameras in the order of choice, a cube's faces together.
        reached: (S,) bool, samples that some place that was tried sees.
        stop: "budget" when no camera more was allowed, "gain" when none would have added
            enough.
        kept: how many of the first groups are earlier ones.
    """

    groups: tuple[Group, ...]
    reached: NDArray[np.bool_]
    stop: Stop
    kept: int = 0


def choose_cameras(
    stage: Stage,
    spheres: Spheres,
    near: Spheres,
    settings: PlacementSettings,
    propose: Proposer,
    *,
    earlier: Sequence[Sequence[CachingCamera]] = (),
    progress: Progress,
) -> Chosen:
    """Choose cubes and perspective cameras, one after the other.

    Without a budget, `settings.primaries` cubes come first and `settings.secondaries`
    perspective cameras then, as in the paper. With one, whatever gains most for its share of
    what is left of the budget comes next, be it a cube, a perspective camera or, where texels
    are counted, a higher resolution for a camera chosen before.

    Args:
        stage: the scene and its samples, settled by the spheres.
        spheres: the maximal ones, largest first: candidates for cubes.
        near: spheres near the views, candidates too. The `source` of a cube's faces is an index
            into `spheres`, then `near`.
        settings: the budget and the knobs.
        propose: gives places for perspective cameras.
        earlier: cameras to keep where they earn it, cubes as one group; in the local frame.
        progress: called with 0 to 1.
    """
    choice = _Greedy(stage, spheres, near, settings, propose)
    choice.keep(earlier)
    kept = len(choice.groups)
    while True:
        progress(choice.done(), "Choosing cameras")
        offer = choice.best()
        if offer is not None:
            choice.take(offer)
        elif choice.stop == "budget" and kept and choice.swap(kept):
            kept -= 1
        else:
            break
    return Chosen(tuple(choice.groups), choice.sights.reached, choice.stop, kept)


def _cost(offer: Offer, left: Budget) -> float:
    """The offer's share of what is left, for comparing; what fits is another question."""
    return left.share(offer.cameras, offer.texels + OVERHEAD * offer.cameras)


class _Greedy:
    """The state of the choice."""

    def __init__(
        self,
        stage: Stage,
        spheres: Spheres,
        near: Spheres,
        settings: PlacementSettings,
        propose: Proposer,
    ) -> None:
        self.stage = stage
        self.settings = settings
        self.sights = Sights(stage)
        places = fixed_places(stage, spheres, near, settings)
        self.candidates = Candidates(stage, self.sights, places, propose, settings.max_resolution)
        self.total = Budget.of(settings)
        self.groups: list[Group] = []
        self.worth = np.zeros(len(stage.samples))
        self.stop: Stop = "gain"
        self.next_place: Choice | None = None
        # Cubes are looked at only where some can be had.
        cubes = settings.budgeted or settings.primaries > 0
        self.cubes = self._most_seeing_cubes(spheres, near) if cubes else []

    @property
    def left(self) -> Budget:
        """The budget less what the groups cost."""
        choices = [choice for group in self.groups for choice in group]
        return self.total.less(len(choices), sum(choice.texels for choice in choices))

    def done(self) -> float:
        """About how much of the work is done, 0 to 1."""
        if not self.total.limited:
            wanted = self.settings.primaries + self.settings.secondaries
            return min(1.0, len(self.groups) / wanted)
        choices = [choice for group in self.groups for choice in group]
        texels = sum(choice.texels for choice in choices)
        return min(1.0, self.total.share(len(choices), texels))

    def keep(self, earlier: Sequence[Sequence[CachingCamera]]) -> None:
        """Begin with those earlier cameras that still earn their place."""
        seen = [
            tuple(self._choice(camera, self.sights.of(camera.origin)) for camera in group)
            for group in earlier
        ]
        self._set(kept_groups(seen, self.stage.samples.weight, self.settings))

    def best(self) -> Offer | None:
        """What gains most for its cost among what can be had; None ends the choice.

        `stop` then says why: something would have gained enough, or nothing.
        """
        self.stop = "gain"
        for offers in self._phases():
            worth = [offer for offer in offers if offer.gained > self.settings.least_gain]
            left = self.left
            fits = [offer for offer in worth if left.fits(offer.cameras, offer.texels)]
            if fits:
                return max(fits, key=lambda offer: offer.gained / _cost(offer, left))
            if worth:
                self.stop = "budget"
        return None

    def take(self, offer: Offer) -> None:
        """Add the offer to the choice."""
        groups = list(self.groups)
        if offer.instead_of is None:
            groups.append(offer.group)
            self.cubes = [cube for cube in self.cubes if cube is not offer.cube]
            self._set(groups)
            return
        # A finer picture hardly changes which place is best next: it need not be sought again.
        groups[offer.instead_of] = offer.group
        place = self.next_place
        self._set(groups)
        self.next_place = place

    def swap(self, kept: int) -> bool:
        """Give up that of the first `kept` groups that is missed least, if another is worth it."""
        number, loss = least_missed(self.groups, self.stage.samples.weight, range(kept))
        before = list(self.groups)
        self._set([group for index, group in enumerate(before) if index != number])
        self.candidates.forget()
        offer = self.best()
        if offer is not None and offer.gained - loss >= SWAP * self.settings.least_gain:
            self.take(offer)
            return True
        self._set(before)
        self.stop = "budget"
        return False

    def _set(self, groups: Sequence[Group]) -> None:
        self.groups = list(groups)
        self.next_place = None
        self.worth = np.zeros(len(self.stage.samples))
        for group in self.groups:
            for choice in group:
                self.worth = joined(self.worth, choice.seen)

    def _phases(self) -> Iterator[list[Offer]]:
        """What is offered together; later phases only when an earlier one has nothing."""
        if self.settings.budgeted:
            left = self.left
            if not left.fits(1, 0) or not left.fits(0, RESOLUTIONS[0] ** 2):
                # No camera more can be paid for. Whether one is worth it is told all the same.
                yield [*self._perspective_offers(), *self._finer_offers()]
                return
            yield [*self._cube_offers(), *self._perspective_offers(), *self._finer_offers()]
            return
        cubes = sum(group[0].camera.kind == "CUBE_FACE" for group in self.groups)
        if cubes < self.settings.primaries:
            yield self._cube_offers()
        if len(self.groups) - cubes < self.settings.secondaries:
            yield self._perspective_offers()
        elif self.settings.secondaries:
            self._note_what_is_missing()

    def _note_what_is_missing(self) -> None:
        """The number of secondaries is used up: say whether another would have gained enough."""
        offers = self._perspective_offers()
        if any(offer.gained > self.settings.least_gain for offer in offers):
            self.stop = "budget"

    def _most_seeing_cubes(self, spheres: Spheres, near: Spheres) -> list[Group]:
        """Cubes in those of the largest spheres and those near the views that see the most."""
        largest = spheres.centre[: self.settings.candidates]
        centres = np.concatenate([largest, near.centre])
        index = np.concatenate([np.arange(len(largest)), len(spheres) + np.arange(len(near))])
        self.sights.ask(list(centres))
        weight = self.stage.samples.weight
        seen = [float(weight[self.sights.of(centre)].sum()) for centre in centres]
        best = np.argsort(np.negative(seen), kind="stable")[:CUBES]
        return [self._cube(centres[number], int(index[number])) for number in best]

    def _cube(self, centre: NDArray[np.float64], index: int) -> Group:
        """The faces of a cube in the sphere `index`, without those that see no sample."""
        visible = self.sights.of(centre)
        faces = cube_cameras(centre, self.settings.max_resolution)
        group = tuple(self._choice(replace(face, source=index), visible) for face in faces)
        return tuple(choice for choice in group if choice.seen.index.size)

    def _cube_offers(self) -> list[Offer]:
        return [offer for cube in self.cubes if cube for offer in self._offers(cube, cube)]

    def _perspective_offers(self) -> list[Offer]:
        if self.next_place is None:
            self.next_place = self._best_place()
        return [] if self.next_place is None else self._offers((self.next_place,))

    def _finer_offers(self) -> list[Offer]:
        """Higher resolutions for the cameras that have been chosen, where texels are counted."""
        offers = []
        for number, group in enumerate(self.groups if self.total.texels is not None else []):
            for face, choice in enumerate(group):
                for tier in self._tiers():
                    if choice.camera.resolution < tier <= self._needed(choice):
                        finer = choice.at(tier)
                        offers.append(
                            Offer(
                                group=(*group[:face], finer, *group[face + 1 :]),
                                gained=gain(finer.seen, self.worth, self.stage.samples.weight),
                                cameras=0,
                                texels=finer.texels - choice.texels,
                                instead_of=number,
                            )
                        )
        return offers

    def _offers(self, group: Group, cube: Group | None = None) -> list[Offer]:
        """The group at the resolutions that it needs, and at lower ones if texels are counted."""
        needed = [self._needed(choice) for choice in group]
        tops = self._tiers() if self.total.texels is not None else self._tiers()[-1:]
        offers = []
        for top in tops:
            if top > max(needed) and top != tops[-1]:
                continue
            settled = tuple(
                choice.at(min(top, need)) for choice, need in zip(group, needed, strict=True)
            )
            offers.append(
                Offer(
                    group=settled,
                    gained=self._gain(settled),
                    cameras=len(settled),
                    texels=sum(choice.texels for choice in settled),
                    cube=cube,
                )
            )
        return offers

    def _gain(self, group: Group) -> float:
        """What a whole group adds; the faces of a cube share only the samples on their edges."""
        total = 0.0
        worth = self.worth
        for choice in group:
            total += gain(choice.seen, worth, self.stage.samples.weight)
            if len(group) > 1:
                worth = joined(worth, choice.seen)
        return total

    def _best_place(self) -> Choice | None:
        """The perspective camera that gains most; None if none sees anything lacking."""
        camera = self.candidates.best(self.worth)
        return None if camera is None else self._choice(camera, self.sights.of(camera.origin))

    def _choice(self, camera: CachingCamera, visible: NDArray[np.int64]) -> Choice:
        return Choice(camera, seen_by_camera(camera, self.stage.samples, visible))

    def _tiers(self) -> list[int]:
        return [tier for tier in RESOLUTIONS if tier <= self.settings.max_resolution]

    def _needed(self, choice: Choice) -> int:
        """The resolution at which the camera is as sharp as the views, for most that it sees."""
        return needed_resolution(
            choice.seen,
            self.stage.samples.weight,
            choice.camera.resolution,
            self.settings.max_resolution,
        )
