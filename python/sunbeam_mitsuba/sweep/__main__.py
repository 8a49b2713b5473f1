"""``python -m sunbeam_mitsuba.sweep``."""

from __future__ import annotations

import sys

# Workers import this module too, under another name, and need nothing of it.
if __name__ == "__main__":
    from .command_line import main

    sys.exit(main())
