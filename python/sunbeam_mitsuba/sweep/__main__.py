"""Entry point of ``python -m sunbeam_mitsuba.sweep``."""

from __future__ import annotations

import sys

# Worker processes import the main module under another name, and do not need the command line.
if __name__ == "__main__":
    from .command_line import main

    sys.exit(main())
