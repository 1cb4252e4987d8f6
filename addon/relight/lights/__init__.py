# SPDX-License-Identifier: GPL-3.0-or-later
"""A light's fragment pass, its shape, what it lights, and objects that glow."""
