# SPDX-License-Identifier: GPL-3.0-or-later
"""The world behind the scene, and its light: suns in it, shared directions, traced rays."""
