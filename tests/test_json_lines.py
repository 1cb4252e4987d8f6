# SPDX-License-Identifier: GPL-3.0-or-later
"""The lines of JSON that a background process ends with."""

from __future__ import annotations

import json
from typing import Any

import pytest

from addon.errors import InputError
from addon.json_lines import run_told
from addon.progress import Cancelled, Progress


def raising(error: BaseException) -> Any:
    def work(progress: Progress) -> dict[str, Any]:
        progress(0.5, "half")
        raise error

    return work


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (InputError("no\nmesh"), 2, "no mesh"),
        (Cancelled(), 1, "stopped"),
        (KeyboardInterrupt(), 1, "stopped"),
        (ZeroDivisionError("by 0"), 1, "this is a fault in Relume (ZeroDivisionError: by 0)"),
    ],
)
def test_every_end_is_told(
    error: BaseException, status: int, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_told(raising(error)) == status
    captured = capsys.readouterr()
    events = [json.loads(line) for line in captured.out.splitlines()]
    assert events == [{"progress": 0.5, "message": "half"}, {"error": words}]
    assert captured.err.splitlines()[-1] == f"relume: {words}"


def test_a_result_is_the_last_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_told(lambda progress: {"cameras": 3}) == 0
    assert json.loads(capsys.readouterr().out) == {"result": {"cameras": 3}}
