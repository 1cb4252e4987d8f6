# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow maps and traced rays: how much of a light's point each pixel sees."""
