# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads JSON that people write."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from .errors import InputError


def read_json(path: Path, what: str) -> Any:
    """What a JSON file holds.

    Args:
        path: the file.
        what: its name in messages, in the plural: "light edits".

    Raises:
        InputError: it can't be read, or is not JSON.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"the {what} '{path}' cannot be read: {reason}; check the path") from error
    except UnicodeDecodeError as error:
        raise InputError(
            f"the {what} '{path}' are not text in UTF-8; save them so, or check the path"
        ) from error
    try:
        return json.loads(text, object_pairs_hook=_without_doubles)
    except _DoubleError as error:
        raise InputError(
            f"the {what} '{path}' have {error} twice in one object; leave one of them"
        ) from error
    # ValueError: also a number of more digits than Python reads.
    except (ValueError, RecursionError) as error:
        raise InputError(f"the {what} '{path}' are not JSON: {error}") from error


class _DoubleError(Exception):
    """A name stands twice in an object; JSON takes the last one without a word."""


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise _DoubleError(repr(name))
        found[name] = value
    return found
