# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl+C and SIGTERM, in this process: the signals are raised here."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from addon.progress import silent
from addon.stopping import stop_signals, stoppable, uninterrupted

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@pytest.fixture(autouse=True)
def this_process_goes_on() -> Iterator[None]:
    """A stopped program ignores further signals to its end, which the tests' own must not."""
    earlier = {number: signal.getsignal(number) for number in SIGNALS}
    yield
    for number, handler in earlier.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_interrupts_ordinary_work(number: signal.Signals) -> None:
    with stop_signals(), pytest.raises(KeyboardInterrupt):
        signal.raise_signal(number)


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_waits_for_the_end_of_a_block(number: signal.Signals) -> None:
    steps = []
    with stop_signals(), pytest.raises(KeyboardInterrupt):  # noqa: PT012 - the steps are the test
        with uninterrupted():
            with uninterrupted():
                signal.raise_signal(number)
            steps.append("rendered")
        steps.append("went on")
    assert steps == ["rendered"]


def test_a_signal_that_was_lost_stops_the_work_at_its_next_step() -> None:
    progress = stoppable(silent)
    with stop_signals():
        progress(0.1, "")
        with pytest.raises(KeyboardInterrupt):  # where Blender would print it and go on
            signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            progress(0.2, "")
    with stop_signals():  # the next work is not stopped for it
        progress(0.1, "")


def test_an_ignored_signal_stays_ignored_and_handlers_are_put_back() -> None:
    before = [signal.getsignal(number) for number in SIGNALS]
    earlier = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with stop_signals():
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, earlier)
    assert [signal.getsignal(number) for number in SIGNALS] == before


def test_further_signals_do_not_interrupt_the_undoing() -> None:
    undone = []
    with pytest.raises(KeyboardInterrupt), stop_signals():  # noqa: PT012
        try:
            signal.raise_signal(signal.SIGINT)
        finally:
            for number in (*SIGNALS, *SIGNALS):
                signal.raise_signal(number)
            undone.append("all of it")
    assert undone == ["all of it"]


def test_they_do_not_become_the_exit_status() -> None:
    code = (  # the interrupt leaves an `exec` of text, and more come after it
        "import atexit, os, signal, sys\n"
        "from addon.stopping import stop_signals\n"
        "atexit.register(lambda: os.kill(os.getpid(), signal.SIGINT))\n"
        "try:\n"
        "    with stop_signals(): exec('signal.raise_signal(signal.SIGTERM)')\n"
        "except KeyboardInterrupt:\n"
        "    os.kill(os.getpid(), signal.SIGTERM); sys.exit(1)\n"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (1, "")


def test_an_error_that_an_interrupt_became_is_one() -> None:
    with pytest.raises(KeyboardInterrupt), stop_signals():  # noqa: PT012
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise ImportError("a library could not be loaded") from None


def test_a_block_within_another_changes_nothing() -> None:
    with pytest.raises(KeyboardInterrupt), stop_signals():  # noqa: PT012
        with stop_signals():
            pass
        signal.raise_signal(signal.SIGTERM)
