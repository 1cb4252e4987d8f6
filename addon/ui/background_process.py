# SPDX-License-Identifier: GPL-3.0-or-later
"""A child process that tells its progress in lines of JSON, read without blocking."""

from __future__ import annotations

import collections
import json
import queue
import subprocess
import threading
from collections.abc import Mapping, Sequence
from typing import IO, Any

# A stopped child is given so long to end by itself before it is killed, in seconds.
GRACE_S = 5.0


class BackgroundProcess:
    """Starts a command at once.

    Its standard output is searched for lines that hold one JSON object (Blender prints others);
    of its standard error the last lines are kept. Threads do the reading and touch nothing
    else, so the owner may poll from a timer. Its standard input is a pipe that stays empty: a
    child that reads its end knows that the owner is gone.
    """

    def __init__(self, command: Sequence[str], environment: Mapping[str, str] | None = None):
        self._events: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self._errors: collections.deque[str] = collections.deque(maxlen=20)
        self._process = subprocess.Popen(
            list(command),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=None if environment is None else dict(environment),
        )
        assert self._process.stdout is not None
        assert self._process.stderr is not None
        self._readers = [
            threading.Thread(target=self._read_events, args=(self._process.stdout,), daemon=True),
            threading.Thread(target=self._read_errors, args=(self._process.stderr,), daemon=True),
        ]
        for reader in self._readers:
            reader.start()

    def _read_events(self, stream: IO[bytes]) -> None:
        for line in stream:
            event = parse_event(line)
            if event is not None:
                self._events.put(event)

    def _read_errors(self, stream: IO[bytes]) -> None:
        for line in stream:
            text = line.decode(errors="replace").strip()
            if text:
                self._errors.append(text)

    def poll(self) -> list[dict[str, Any]]:
        """The objects that came in since the last call, oldest first."""
        events = []
        while not self._events.empty():
            events.append(self._events.get_nowait())
        return events

    @property
    def pid(self) -> int:
        """The child's process number."""
        return self._process.pid

    @property
    def status(self) -> int | None:
        """The exit status once the child has ended and all it said has been read, else None."""
        if any(reader.is_alive() for reader in self._readers):
            return None
        return self._process.poll()

    @property
    def error_lines(self) -> tuple[str, ...]:
        """The last lines of standard error."""
        return tuple(self._errors)

    def stop(self) -> None:
        """Ask the child to end, and make it. Returns when it has ended."""
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(GRACE_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        if self._process.stdin is not None:
            self._process.stdin.close()
        # The pipes end with the child; a grandchild may hold them open a little longer.
        for reader in self._readers:
            reader.join(GRACE_S)


def parse_event(line: bytes) -> dict[str, Any] | None:
    """The JSON object in a line, or None when it holds anything else."""
    text = line.strip()
    if not text.startswith(b"{"):
        return None
    try:
        event = json.loads(text)
    except ValueError:
        return None
    return event if isinstance(event, dict) else None
