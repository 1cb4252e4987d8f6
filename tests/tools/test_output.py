# SPDX-License-Identifier: GPL-3.0-or-later
"""Standard output belongs to the result alone."""

from __future__ import annotations

import io
import json
import math
import os

import pytest

from addon.progress import part_of
from tools.output import progress_on, standard_output, to_json


def test_only_the_result_reaches_standard_output(capfd: pytest.CaptureFixture[str]) -> None:
    with standard_output() as out:
        print("from Python")
        os.write(1, b"from C\n")
        out.write("result\n")
    print("afterwards")
    captured = capfd.readouterr()
    assert captured.out == "result\nafterwards\n"
    assert "from Python" in captured.err
    assert "from C" in captured.err


def test_numbers_that_json_lacks_become_null() -> None:
    result = {"a": math.inf, "b": [math.inf, 1.5, (2, -math.inf)], "d": {3: "Ü"}}
    expected = {"a": None, "b": [None, 1.5, [2, None]], "d": {"3": "Ü"}}
    assert json.loads(to_json(result)) == expected


def test_figures_that_are_no_numbers_are_named() -> None:
    result = {"views": [{"flip": 0.5}, {"flip": math.nan}], "psnr": math.inf}
    written = json.loads(to_json(result))
    assert written["views"][1]["flip"] is None
    assert written["not_computed"] == ["views.1.flip"]


def test_a_log_is_sparse_but_its_end_is_always_told() -> None:
    stream = io.StringIO()
    show = progress_on(stream)
    for step in range(100):
        show(step / 100, "working")
    show(1.0, "done")
    lines = stream.getvalue().splitlines()
    assert lines[0] == "[  0 %] working"
    assert lines[-1] == "[100 %] done"
    assert len(lines) == 2


def test_a_part_of_the_progress_stays_in_its_part() -> None:
    told: list[tuple[float, str]] = []
    step = part_of(lambda fraction, message: told.append((fraction, message)), 0.25, 0.75)
    step(0.0, "a")
    step(0.5, "b")
    step(1.0, "c")
    assert told == [(0.25, "a"), (0.5, "b"), (0.75, "c")]
