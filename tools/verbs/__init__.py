# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line's verbs, a file each.

A verb is a module with NAME, HELP, `add_arguments(parser)`, `run(args, progress)` that gives
plain values for JSON, and `describe(result)` that turns them into lines for a person. Modules
import bpy inside `run`, so that `relume compare` and `relume --help` start at once.
"""

from __future__ import annotations

import argparse
from typing import Any, Protocol

from addon.progress import Progress

from . import bake, compare, evaluate, inspect, place, relight


class Verb(Protocol):
    """What each module here gives."""

    NAME: str
    HELP: str

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Add the verb's arguments to its parser."""

    def run(self, args: argparse.Namespace, progress: Progress) -> dict[str, Any]:
        """Do the work and return plain values. Raises InputError for bad input."""

    def describe(self, report: dict[str, Any]) -> str:
        """The same values as lines for a person."""


VERBS: tuple[Verb, ...] = (place, bake, inspect, relight, compare, evaluate)
