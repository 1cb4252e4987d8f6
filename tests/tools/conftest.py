# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line inside the tests' own process, which saves starting Blender each time."""

from __future__ import annotations

import subprocess
from collections.abc import Callable

import pytest

from tools.relume import main

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def relume_here(capfd: pytest.CaptureFixture[str]) -> Run:
    """As `test_command_line.relume`, which starts a process: some tests of each kind use that."""

    def run(*words: object) -> subprocess.CompletedProcess[str]:
        capfd.readouterr()
        arguments = [str(word) for word in words]
        status = main(arguments)
        captured = capfd.readouterr()
        return subprocess.CompletedProcess(arguments, status, captured.out, captured.err)

    return run
