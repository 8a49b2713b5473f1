"""The exception that stops a sweep."""

from __future__ import annotations


class SweepError(Exception):
    """A sweep cannot begin or continue. The message is one line that names the fault, and accepted values if any."""
