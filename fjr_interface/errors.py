"""The one exception that a user is meant to read."""

from __future__ import annotations


class InputError(Exception):
    """Something that the user gave cannot be used.

    The message is one sentence that names the file or parameter, the field and the mend. Command
    lines print it and exit with status 2; nodes log it and refuse the value.
    """
