# SPDX-License-Identifier: GPL-3.0-or-later
"""The one exception for bad input."""


class InputError(Exception):
    """Something that the user gave cannot be used.

    The message is one sentence that names the thing and the remedy. The command line prints
    it and ends with exit status 2; Blender's operators report it.
    """
