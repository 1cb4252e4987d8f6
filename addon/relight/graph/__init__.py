# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame graph: which pass reads and makes what, and what an edit makes dirty."""
