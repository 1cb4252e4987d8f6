# SPDX-License-Identifier: GPL-3.0-or-later
"""What the linters cannot say about who imports whom."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCES = sorted(path for path in (ROOT / "addon").rglob("*.py") if "wheels" not in path.parts)


def absolute_imports(path: Path) -> Iterator[str]:
    """The first names of what a file imports absolutely."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module.partition(".")[0]


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_inside_the_extension_are_relative(path: Path) -> None:
    # Blender loads the extension as bl_ext.<repository>.relume, and without tools/ or tests/.
    assert not {"addon", "tools", "tests", "benchmarks"} & set(absolute_imports(path))


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_file_names_its_licence(path: Path) -> None:
    assert path.read_text(encoding="utf-8").startswith(
        "# SPDX-License-Identifier: GPL-3.0-or-later\n"
    )
