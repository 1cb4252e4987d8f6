# SPDX-License-Identifier: GPL-3.0-or-later
"""Every lobe's parameters equal what Cycles uses, for trees of every supported node."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from . import (
    trees_of_closures,
    trees_of_groups,
    trees_of_inputs,
    trees_of_mixes,
    trees_of_textures,
    trees_of_views,
)
from .material_trees import BakedTrees, Tree, bake_trees, check_tree


def _by_name(trees: Sequence[Tree]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("tree", trees, ids=[tree.name for tree in trees])


@pytest.fixture(scope="module")
def closures(tmp_path_factory: pytest.TempPathFactory) -> BakedTrees:
    return bake_trees(trees_of_closures.TREES, tmp_path_factory.mktemp("closures"))


@_by_name(trees_of_closures.TREES)
def test_closure(closures: BakedTrees, tree: Tree) -> None:
    check_tree(closures, tree)


MIXES = [*trees_of_mixes.TREES, *trees_of_views.TREES, *trees_of_groups.TREES]


@pytest.fixture(scope="module")
def mixes(tmp_path_factory: pytest.TempPathFactory) -> BakedTrees:
    return bake_trees(MIXES, tmp_path_factory.mktemp("mixes"))


@_by_name(MIXES)
def test_mix(mixes: BakedTrees, tree: Tree) -> None:
    check_tree(mixes, tree)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> BakedTrees:
    folder = tmp_path_factory.mktemp("inputs")
    return bake_trees(trees_of_inputs.TREES, folder, frame=trees_of_inputs.FRAME)


@_by_name(trees_of_inputs.TREES)
def test_input(inputs: BakedTrees, tree: Tree) -> None:
    check_tree(inputs, tree)


@pytest.fixture(scope="module")
def textures(tmp_path_factory: pytest.TempPathFactory) -> BakedTrees:
    return bake_trees(trees_of_textures.TREES, tmp_path_factory.mktemp("textures"))


@_by_name(trees_of_textures.TREES)
def test_texture(textures: BakedTrees, tree: Tree) -> None:
    check_tree(textures, tree)


@pytest.fixture(scope="module")
def greys(tmp_path_factory: pytest.TempPathFactory) -> BakedTrees:
    folder = tmp_path_factory.mktemp("greys")
    return bake_trees(trees_of_inputs.GREY, folder, frame=trees_of_inputs.FRAME)


@_by_name(trees_of_inputs.GREY)
def test_channels_of_one_component(greys: BakedTrees, tree: Tree) -> None:
    assert "specular_f90" in greys.plan.grey
    check_tree(greys, tree)


@pytest.fixture(scope="module")
def alike(tmp_path_factory: pytest.TempPathFactory) -> BakedTrees:
    return bake_trees(trees_of_inputs.ALIKE, tmp_path_factory.mktemp("alike"))


@_by_name(trees_of_inputs.ALIKE)
def test_channels_that_are_the_same(alike: BakedTrees, tree: Tree) -> None:
    assert alike.plan.same == {"specular_f90": "specular_f0"}
    check_tree(alike, tree)


def test_a_channel_may_be_a_constant_of_each_material(closures: BakedTrees) -> None:
    assert "roughness" in closures.plan.material_constants
