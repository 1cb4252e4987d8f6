# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line, the demo and what they measure with; not part of the installed extension."""
