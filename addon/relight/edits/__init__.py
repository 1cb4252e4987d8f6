# SPDX-License-Identifier: GPL-3.0-or-later
"""EDITS.json and SURFACES.json: edits of lights and surfaces by name, read and applied."""
