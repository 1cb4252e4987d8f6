# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads Blender and gives plain arrays.

In: the open .blend, through an evaluated dependency graph. Out: `SceneGeometry`, `View`s and
`Light`s, which every other room takes and which know nothing of Blender. Only the modules
named `*_reader` import bpy, so the arrays' own modules can be used without it.
"""
