# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands in a light's beam (barn doors, slides, blockers, ...) and what its nodes emit."""
