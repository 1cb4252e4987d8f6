# SPDX-License-Identifier: GPL-3.0-or-later
"""What every pass that shades surfaces draws with: blending, lobes' tables, surface inputs."""
