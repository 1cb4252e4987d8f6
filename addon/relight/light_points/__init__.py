# SPDX-License-Identifier: GPL-3.0-or-later
"""Which point of a light, or which cell of it, each sample sees it from."""
