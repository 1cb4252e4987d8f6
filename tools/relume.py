# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: `relume VERB ...`, or `python -m tools.relume VERB ...`.

Every verb takes --json (one JSON object on standard output) and ends with 0; with 2 for
arguments or input that cannot be used, after one line on standard error; with 1 for anything
else.
"""

from __future__ import annotations

import argparse
import re
import sys
import traceback
from collections.abc import Sequence

from addon.errors import InputError
from addon.progress import Cancelled
from addon.stopping import stop_signals, stoppable

BAD_INPUT = 2
FAILURE = 1

# Several numbers between commas, the first of them negative.
_NUMBERS = re.compile(r"-[\d.][^,]*(,[^,]*)+")


def parser() -> argparse.ArgumentParser:
    """All verbs and their arguments."""
    from .verbs import VERBS

    top = argparse.ArgumentParser(
        prog="relume", description="Relight Blender shots from deep framebuffers baked once."
    )
    verbs = top.add_subparsers(dest="verb", required=True, metavar="VERB")
    for verb in VERBS:
        sub = verbs.add_parser(verb.NAME, help=verb.HELP, description=verb.HELP)
        verb.add_arguments(sub)
        sub.add_argument(
            "--json", action="store_true", help="print one JSON object on standard output"
        )
        sub.set_defaults(module=verb)
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb and return the exit status.

    Args:
        argv: the words after the program's name; None for the process's own.
    """
    words = sys.argv[1:] if argv is None else list(argv)
    verb = words[0] if words and not words[0].startswith("-") else ""
    name = f"relume {verb}".rstrip()
    try:
        # What takes time to load is loaded in this block.
        with stop_signals():
            return _run(words)
    except InputError as error:
        return _fail(f"{name}: {_one_line(error)}", BAD_INPUT)
    except (Cancelled, KeyboardInterrupt):
        return _fail(f"{name}: stopped", FAILURE)
    except Exception:  # noqa: BLE001 - the last resort: the trace is the message
        traceback.print_exc()
        return _fail(f"{name}: this is a fault in Relume", FAILURE)


def _run(words: Sequence[str]) -> int:
    """Run one verb and print its result; the exit status of all that raises nothing."""
    try:
        args = parser().parse_args(_with_values(words))
    except SystemExit as leave:  # argparse: 0 after --help, 2 after a wrong argument
        return int(leave.code or 0)
    from .output import progress_on, standard_output, to_json

    with standard_output() as out:
        result = args.module.run(args, stoppable(progress_on(sys.stderr)))
        for warning in result.get("warnings", ()):
            print(f"note: {warning}", file=sys.stderr, flush=True)
        text = to_json(result) if args.json else args.module.describe(result)
        out.write(text + "\n")
        out.flush()
    return 0


def _with_values(words: Sequence[str]) -> list[str]:
    """The same words, "--box -1,0,0,1,1,2" as "--box=-1,0,0,1,1,2".

    argparse takes a word for an option that begins with a minus and is not one plain number.
    """
    result: list[str] = []
    for word in words:
        option = result[-1] if result else ""
        if _NUMBERS.fullmatch(word) and option.startswith("--") and "=" not in option:
            result[-1] = f"{option}={word}"
        else:
            result.append(word)
    return result


def _one_line(error: InputError) -> str:
    return " ".join(str(error).split())


def _fail(message: str, status: int) -> int:
    print(message, file=sys.stderr, flush=True)
    return status


if __name__ == "__main__":
    sys.exit(main())
