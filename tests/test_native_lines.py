# SPDX-License-Identifier: GPL-3.0-or-later
"""Only the named lines of C code are kept back, and the others come also after an error."""

from __future__ import annotations

import os

import pytest

from addon.native_lines import without_lines


def test_other_lines_are_written(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ZeroDivisionError), without_lines(b"Fault 1"):  # noqa: PT012
        os.write(2, b"Fault 1: harmless\nFault 2\n")
        raise ZeroDivisionError
    assert capfd.readouterr().err == "Fault 2\n"
    os.write(2, b"Fault 1\n")
    assert capfd.readouterr().err == "Fault 1\n"
