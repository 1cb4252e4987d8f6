# SPDX-License-Identifier: GPL-3.0-or-later
"""Every lobe's parameters equal what Cycles uses, for trees of every supported node."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from . import trees_of_closures, trees_of_groups, trees_of_mixes, trees_of_views
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
