# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from addon.ui import background_process
from addon.ui.background_process import BackgroundProcess, parse_event


def finish(process: BackgroundProcess, patience_s: float = 20.0) -> list[dict[str, Any]]:
    events = []
    end = time.monotonic() + patience_s
    while process.status is None:
        events += process.poll()
        assert time.monotonic() < end
        time.sleep(0.01)
    return events + process.poll()


def python(code: str) -> BackgroundProcess:
    return BackgroundProcess([sys.executable, "-c", code])


@pytest.mark.parametrize(
    "line", [b"", b"Fra:1 Mem:20M\n", b"{not json}\n", b"[1]\n", b'"text"\n', b"{\xff\n"]
)
def test_other_lines_are_no_events(line: bytes) -> None:
    assert parse_event(line) is None


def test_an_event_is_one_json_object() -> None:
    assert parse_event(b' {"progress": 0.5}\r\n') == {"progress": 0.5}


def test_events_come_in_order_between_other_output() -> None:
    process = python(
        "print('Blender 5.2.2')\n"
        "for i in range(100): print('noise'); print('{\"progress\": %d}' % i, flush=True)"
    )
    events = finish(process)
    process.stop()
    assert [event["progress"] for event in events] == list(range(100))
    assert process.status == 0


def test_a_last_line_without_newline_is_not_lost() -> None:
    process = python("import sys; sys.stdout.write('{\"result\": {}}')")
    assert finish(process) == [{"result": {}}]
    process.stop()


def test_a_failing_child_leaves_its_status_and_last_words() -> None:
    process = python("import sys; sys.stderr.write('cannot write /full\\n\\n'); sys.exit(2)")
    finish(process)
    process.stop()
    assert process.status == 2
    assert process.error_lines == ("cannot write /full",)


def test_polling_does_not_wait() -> None:
    process = python("import time; time.sleep(60)")
    start = time.monotonic()
    assert process.poll() == []
    assert process.status is None
    # Far less than the child's sleep; a busy machine may need some milliseconds.
    assert time.monotonic() - start < 5.0
    process.stop()
    assert process.status is not None


def test_stop_ends_a_child_that_ignores_the_polite_request(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(background_process, "GRACE_S", 0.5)
    process = python(
        "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "print('{\"progress\": 0}', flush=True); time.sleep(60)"
    )
    end = time.monotonic() + 20.0
    while not process.poll():
        assert time.monotonic() < end
        time.sleep(0.01)
    process.stop()
    assert finish(process, 5.0) == []


def test_a_large_output_does_not_block_the_child() -> None:
    """More than any pipe's buffer, on both streams, before anything is polled."""
    process = python(
        "import sys\nfor i in range(5000): print('x' * 100); sys.stderr.write('y' * 100 + '\\n')"
    )
    end = time.monotonic() + 20.0
    while process.status is None:
        assert time.monotonic() < end
        time.sleep(0.01)
    process.stop()
    assert len(process.error_lines) == 20


def test_a_child_can_tell_that_its_owner_is_gone() -> None:
    """The owner here is a process that starts a child like the extension's, and is killed."""
    owner = subprocess.Popen(
        [sys.executable, "-c", OWNER, str(Path(__file__).parents[2])], stdout=subprocess.PIPE
    )
    assert owner.stdout is not None
    words = next(line.split() for line in owner.stdout if line.startswith(b"CHILD"))
    child = int(words[1])
    owner.kill()
    owner.wait()
    owner.stdout.close()
    end = time.monotonic() + 60.0
    while is_running(child):
        assert time.monotonic() < end
        time.sleep(0.05)


OWNER = """
import sys, time
sys.path.insert(0, sys.argv[1])
from addon.ui.background_process import BackgroundProcess
child = "import time; from addon.ui.background_script import end_with_parent; "
child = f"import sys; sys.path.insert(0, {sys.argv[1]!r}); " + child
process = BackgroundProcess([sys.executable, "-c", child + "end_with_parent(); time.sleep(60)"])
print("CHILD", process._process.pid, flush=True)
time.sleep(60)
"""


def is_running(pid: int) -> bool:
    """A process that has ended but was not waited for does not count."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state != "Z"
