# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl+C and SIGTERM, in this process: the signals are raised here."""

from __future__ import annotations

import signal

import pytest

from addon.progress import silent
from addon.stopping import stop_signals, stoppable, uninterrupted

SIGNALS = (signal.SIGINT, signal.SIGTERM)


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
