"""``python -m sunbeam_mitsuba.sweep``."""

from __future__ import annotations

import sys

# Workers import this module under another name and do not need the command line.
if __name__ == "__main__":
    from .command_line import main

    sys.exit(main())
