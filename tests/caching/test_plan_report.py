# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake's report: counts of channels as Lightspeed's figure 5 has them, sizes, materials."""

from __future__ import annotations

from dataclasses import replace

from addon.caching.bake_report import BakeReport
from addon.caching.channels import CHANNEL_BY_NAME, channels_of
from addon.caching.plan import Approximation, ChannelPlan
from addon.caching.plan_report import float32_bytes, material_report, plan_report, value_notes
from tools.output import to_json

PLAN = ChannelPlan(
    stored=("depth", "material_id", "normal", "diffuse_color"),
    constants={"roughness": (0.25,)},
    material_constants={"layer_f0": ((0.04,), (0.0,), (0.1,))},
    same={"specular_f90": "diffuse_color", "layer_f90": "material_id"},
    grey=frozenset({"diffuse_color"}),
    lobes=2,
    material_names=("Möbel", "", "Glass"),
    approximations=(
        Approximation("Glass", "is shown as glossy"),
        Approximation("(none)", "has no nodes"),
        Approximation("Glass", "its volume is left out"),
    ),
)


def entries() -> dict[str, dict]:
    precisions = {"normal": {"half": 3}, "diffuse_color": {"half": 1, "float32": 2}}
    return {entry["name"]: entry for entry in plan_report(PLAN, precisions)["table"]}


def test_counts() -> None:
    report = plan_report(PLAN, {})
    everything = len(entries())
    assert report["asked"]["channels"] == everything
    assert report["asked"]["values"] * 4 == float32_bytes(PLAN)
    # All but constants; specular_f90 and layer_f90 are duplicates, layer_f0 one of each material.
    assert report["varying"] == {"channels": 7, "values": (1 + 1 + 3 + 3) + 3 + 1 + 1}
    # Of the grey colour's three values two are duplicates.
    assert report["unique"] == {"channels": 5, "values": (1 + 1 + 3 + 1) + 1}
    assert report["stored"] == {"channels": 4, "values": 1 + 1 + 3 + 1}


def test_a_table_of_as_many_lobes_as_there_are() -> None:
    one = plan_report(replace(PLAN, lobes=1), {})
    assert one["asked"]["channels"] < len(entries())
    assert {entry["name"] for entry in one["table"]} < set(entries())


def test_every_channel_says_where_it_lives() -> None:
    table = entries()
    assert table["normal"] == {
        "name": "normal",
        "components": 3,
        "lives": "stored",
        "stored_components": 3,
        "cameras_by_precision": {"half": 3},
    }
    assert table["diffuse_color"]["stored_components"] == 1
    assert (table["layer_f90"]["lives"], table["layer_f90"]["channel"]) == ("same", "material_id")
    assert table["layer_f0"]["lives"] == "constant of each material"
    assert table["layer_f0"]["values"] == {"Möbel": [0.04], "(none)": [0.0], "Glass": [0.1]}
    assert table["diffuse_color"]["cameras_by_precision"] == {"half": 1, "float32": 2}
    # Stored, but in none of the cameras that were baked now.
    assert table["depth"]["cameras_by_precision"] == {}
    assert (table["roughness"]["lives"], table["roughness"]["value"]) == ("constant", [0.25])
    emission = table["emission"]
    assert (emission["lives"], emission["value"]) == ("neutral", [0.0, 0.0, 0.0])
    for name, entry in table.items():
        assert entry["components"] == CHANNEL_BY_NAME[name].components


def test_materials_with_what_is_approximated() -> None:
    assert material_report(PLAN) == [
        {"name": "Möbel", "approximated": []},
        {"name": "(none)", "approximated": ["has no nodes"]},
        {"name": "Glass", "approximated": ["is shown as glossy", "its volume is left out"]},
    ]


def report() -> BakeReport:
    return BakeReport(
        cameras=3,
        baked=2,
        kept=1,
        texels=1000,
        plan=PLAN,
        precisions={"normal": {"half": 2}},
        raw_bytes=16_000,
        stored_bytes=3_000,
        cache_bytes=4_500,
        seconds={"prepare": 0.5, "cycles": 2.0},
    )


def test_bytes_of_a_texel() -> None:
    plain = report().to_json()
    assert plain["bytes_per_texel"] == {
        "raw": 16.0,
        "stored": 3.0,
        "all_float32": float32_bytes(PLAN),
    }
    assert (plain["raw_bytes"], plain["stored_bytes"], plain["cache_bytes"]) == (16000, 3000, 4500)


def test_nothing_baked_is_no_division() -> None:
    kept = replace(report(), texels=0, raw_bytes=0, stored_bytes=0, baked=0).to_json()
    assert kept["bytes_per_texel"] == {
        "raw": None,
        "stored": None,
        "all_float32": float32_bytes(PLAN),
    }


def test_it_is_one_object_of_json() -> None:
    text = to_json(report().to_json())
    assert "material 'Glass': is shown as glossy" in text
    assert "not_computed" not in text


def test_many_varying_values_are_told() -> None:
    assert not value_notes(PLAN)
    stored = tuple(channel.name for channel in channels_of(2))
    (note,) = value_notes(ChannelPlan(stored, {}, ("a",), lobes=2))
    assert "some GPUs draw 32" in note
