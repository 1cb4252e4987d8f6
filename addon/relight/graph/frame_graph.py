# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pass reads what, and what an edit therefore makes dirty.

A graph of named passes. Each reads resources and makes resources; a resource that no pass makes is
an input, such as the view or a light's colour. Touching an input makes every pass dirty that reads
it, directly or through others, and nothing else.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class FramePass:
    """One step on the way to the picture.

    Attributes:
        name: unique.
        inputs: the resources that it reads.
        outputs: the resources that it makes; no other pass makes them.
        per: what it is repeated for, for readers: "sample", "sample and light" or "".
    """

    name: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    per: str = ""


class FrameGraph:
    """Passes in the order in which they run, and which of them are dirty.

    Args:
        passes: each after those whose outputs it reads. All are dirty at first.

    Raises:
        ValueError: two passes have one name or make one resource, or a pass reads what only a
            later one makes.
    """

    def __init__(self, passes: Sequence[FramePass]) -> None:
        self._passes: dict[str, FramePass] = {}
        self._maker: dict[str, str] = {}
        self._seconds: dict[str, float] = {}
        self._set(passes)
        self._dirty = set(self._passes)

    @property
    def passes(self) -> tuple[FramePass, ...]:
        """All passes, in order."""
        return tuple(self._passes.values())

    @property
    def inputs(self) -> tuple[str, ...]:
        """The resources that no pass makes, in the order in which they are first read."""
        read = dict.fromkeys(name for each in self.passes for name in each.inputs)
        return tuple(name for name in read if name not in self._maker)

    def replace(self, passes: Sequence[FramePass]) -> tuple[str, ...]:
        """Take other passes, as when a light is added.

        Returns:
            the names of the passes that are dirty by it: new ones, those that read something
            else than before, and all behind them.
        """
        before = self._passes
        self._set(passes)
        self._dirty &= set(self._passes)
        changed = [each for each in self.passes if before.get(each.name) != each]
        return self._soil(each.name for each in changed)

    def touch(self, *resources: str) -> tuple[str, ...]:
        """Resources changed: the names of all passes that depend on them, in order."""
        wanted = set(resources)
        return self._soil(each.name for each in self.passes if wanted & set(each.inputs))

    def is_dirty(self, name: str) -> bool:
        """Whether a pass must run."""
        return name in self._dirty

    def clean(self, *names: str) -> None:
        """Passes made all that they have to make of what is current."""
        self._dirty.difference_update(names)

    def ran(self, name: str, seconds: float, *, last: bool) -> None:
        """A pass ran once, for so long; `last` when it need not run again."""
        self._seconds[name] = seconds
        if last:
            self.clean(name)

    def seconds(self, name: str) -> float | None:
        """How long a pass took when it last ran; None if nobody looked at the clock."""
        return self._seconds.get(name)

    def mermaid(self) -> str:
        """The graph as a Mermaid flow chart; inputs are round."""
        nodes = {name: f"i{k}" for k, name in enumerate(self.inputs)}
        nodes |= {each.name: f"p{k}" for k, each in enumerate(self.passes)}
        lines = ["flowchart LR"]
        lines += [f'  {nodes[name]}(["{name}"])' for name in self.inputs]
        for each in self.passes:
            per = f"<br/>each {each.per}" if each.per else ""
            lines.append(f'  {nodes[each.name]}["{each.name}{per}"]')
        for each in self.passes:
            for name in each.inputs:
                maker = self._maker.get(name)
                arrow = f'-- "{name}" -->' if maker is not None else "-->"
                lines.append(f"  {nodes[maker or name]} {arrow} {nodes[each.name]}")
        return "\n".join([*lines, ""])

    def _set(self, passes: Sequence[FramePass]) -> None:
        makers: dict[str, str] = {}
        later = {name for each in passes for name in each.outputs}
        for each in passes:
            later -= set(each.outputs)
            unmade = [name for name in each.inputs if name in later or name in each.outputs]
            if unmade:
                raise ValueError(f"pass {each.name} reads {unmade[0]}, which is made after it")
            for name in each.outputs:
                if name in makers:
                    raise ValueError(f"{makers[name]} and {each.name} both make {name}")
                makers[name] = each.name
        self._passes = {each.name: each for each in passes}
        if len(self._passes) != len(passes):
            raise ValueError("two passes have one name")
        self._maker = makers

    def _soil(self, names: Iterable[str]) -> tuple[str, ...]:
        """Make passes dirty, and all that read their outputs."""
        reached = set(names)
        stale: set[str] = set()
        for each in self.passes:
            if each.name in reached or stale & set(each.inputs):
                reached.add(each.name)
                stale |= set(each.outputs)
        self._dirty |= reached
        return tuple(name for name in self._passes if name in reached)
