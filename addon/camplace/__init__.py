# SPDX-License-Identifier: GPL-3.0-or-later
"""Decides where caching cameras go (paper section III.1).

In: `SceneGeometry` and the shot's `View`s. Out: a `Placement`, whose `CachingCamera`s are what
`caching/` bakes and `corrmap/` reads. `place.place_cameras` is the entry; `cameras_file` keeps
its cameras on disk.

The order of the work: `samples` (surface points that stand for the surface), `spheres` (maximal
spheres, the primary cameras), `votes` on a `grid` (candidates for secondary cameras), `aim`
(their attributes) and `coverage` (what a camera adds). `rays` asks embree.
"""
