# SPDX-License-Identifier: GPL-3.0-or-later
"""JSON that people write: what is wrong with it is said in one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest

from addon.errors import InputError
from addon.json_file import read_json


def test_what_it_holds(tmp_path: Path) -> None:
    path = tmp_path / "edits.json"
    path.write_text('{"Lumière": {"energy": 1.5}, "Rim": null}', encoding="utf-8")
    assert read_json(path, "light edits") == {"Lumière": {"energy": 1.5}, "Rim": None}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "cannot be read: No such file or directory; check the path"),
        (b"\xff\xfe\x00", "not text in UTF-8"),
        (b"", "are not JSON"),
        (b"[" * 100_000, "are not JSON"),
        # JSON takes the last one without a word.
        (b'{"Key": null, "Rim": null, "Key": {}}', "have 'Key' twice in one object"),
        (b'[{"Key": {"energy": 1, "energy": 2}}]', "have 'energy' twice in one object"),
    ],
)
def test_what_cannot_be_used(tmp_path: Path, content: bytes | None, words: str) -> None:
    path = tmp_path / "edits.json"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=words) as caught:
        read_json(path, "light edits")
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
