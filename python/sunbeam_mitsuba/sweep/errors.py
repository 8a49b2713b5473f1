"""What stops a sweep before or during its work."""

from __future__ import annotations


class SweepError(Exception):
    """A sweep cannot begin or go on; the message is one line that says what is wrong and what is accepted."""
