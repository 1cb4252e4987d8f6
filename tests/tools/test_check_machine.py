# SPDX-License-Identifier: GPL-3.0-or-later
"""What is missing is named by its Debian package."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools import check_machine


def machine(root: Path, *, driver: bool) -> Path:
    if driver:
        folder = root / "usr/lib/x86_64-linux-gnu/dri"
        folder.mkdir(parents=True)
        (folder / "swrast_dri.so").touch()
    return root


def test_a_complete_machine_lacks_nothing(tmp_path: Path) -> None:
    root = machine(tmp_path, driver=True)
    assert check_machine.missing_packages(lambda name: name != check_machine.OWN_EGL, root) == ()


@pytest.mark.parametrize(
    ("library", "package"),
    [("libEGL.so.1", "libegl1"), ("libGL.so.1", "libgl1"), ("libXi.so.6", "libxi6")],
)
def test_a_missing_library_names_its_package(tmp_path: Path, library: str, package: str) -> None:
    root = machine(tmp_path, driver=True)
    absent = {library, check_machine.OWN_EGL}
    assert check_machine.missing_packages(lambda name: name not in absent, root) == (package,)


def test_a_missing_software_driver_names_its_package(tmp_path: Path) -> None:
    found = check_machine.missing_packages(lambda name: name != check_machine.OWN_EGL, tmp_path)
    assert found == ("libgl1-mesa-dri",)


def test_a_graphics_cards_own_driver_replaces_mesas(tmp_path: Path) -> None:
    assert check_machine.missing_packages(lambda name: name != "libEGL_mesa.so.0", tmp_path) == ()


def test_one_line_tells_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(check_machine, "missing_packages", lambda: ("libegl1", "libgl1"))
    assert check_machine.main() == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "apt-get install libegl1 libgl1" in error
