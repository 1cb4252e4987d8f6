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
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the {what} '{path}': {error}") from error
    try:
        return json.loads(text)
    # ValueError: also a number of more digits than Python reads.
    except (ValueError, RecursionError) as error:
        raise InputError(f"the {what} '{path}' are not JSON: {error}") from error
