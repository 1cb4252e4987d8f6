# SPDX-License-Identifier: GPL-3.0-or-later
"""Decides which channels a scene needs, has Cycles bake them, and keeps them on disk.

In: caching cameras, and the open .blend. Out: a `ChannelPlan` and one `DeepFramebuffer` for
each camera, read back from the cache folder by `corrmap/`. Only `specialize` and `bake` (and
what they are made of) import bpy.
"""
