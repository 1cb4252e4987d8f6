# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of folders and of layers: unique, and never a way out of the folder."""

from __future__ import annotations

from tools.unique_names import folder_names, unique_names


def test_names_are_unique_and_free_ones_stay() -> None:
    assert unique_names(["A_B", "A_B", "A_B_2", "a_b"]) == ["A_B", "A_B_3", "A_B_2", "a_b"]


def test_folders_stay_inside() -> None:
    names = ["/x", "..", ".", "", "Cache", "cam", "Cam", "Kamera \u00e4-1.001", "a\\b", "../../x"]
    found = folder_names(names, taken=("cache",))
    assert found[0] == "_x"
    assert found[4:8] == ["Cache_2", "cam", "Cam_2", "Kamera \u00e4-1.001"]
    assert len({name.casefold() for name in found}) == len(names)
    for name in found:
        assert name not in ("", ".", "..")
        assert not set("/\\") & set(name)
