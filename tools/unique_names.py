# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's names as names of folders and of a picture's layers, where fewer are possible."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence


def unique_names(
    wanted: Iterable[str], taken: Iterable[str] = (), *, fold_case: bool = False
) -> list[str]:
    """The same names in the same order; "A" that is taken becomes "A_2".

    Args:
        wanted: what they are to be.
        taken: what none of them may be.
        fold_case: "a" and "A" are one name, as in many file systems.
    """

    def key(name: str) -> str:
        return name.casefold() if fold_case else name

    wanted = list(wanted)
    used = {key(name) for name in taken}
    # A name that is free as it is stays as it is, whatever stands before it.
    meant = {key(name) for name in wanted}
    names = []
    for name in wanted:
        found, number = name, 1
        while key(found) in used or (number > 1 and key(found) in meant):
            number += 1
            found = f"{name}_{number}"
        used.add(key(found))
        names.append(found)
    return names


def folder_names(names: Sequence[str], taken: Sequence[str] = ()) -> list[str]:
    """Names of folders inside a folder: never a path, "." or "..", and never one twice."""
    safe = [re.sub(r"[^\w .-]", "_", name) for name in names]
    # A leading dot hides a folder or leaves it, and a trailing dot or space is dropped by some.
    safe = [re.sub(r"^\.+|[. ]+$", "_", name) or "_" for name in safe]
    return unique_names(safe, taken, fold_case=True)
