# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of light: their samples and stages, how they are drawn, and their sum."""
