"""Progress of a sweep in cases, the rows of its table: a bar on a terminal, lines elsewhere."""

from __future__ import annotations

import sys
import time
from types import TracebackType

from tqdm import tqdm

# Seconds before a terminal's bar appears; shorter sweeps show none. Larger values hide the bar of more sweeps.
_BAR_DELAY_SECONDS = 2.0
# Seconds before the first line, and between lines, where stderr is no terminal. Smaller values make longer logs.
_LINE_SECONDS = 30.0


class Progress:
    """Counts cases, and shows their number on stderr with the rate and the time left.

    The public attributes ``total``, ``done`` and ``failed`` are numbers of cases. ``done`` includes the failed ones.
    """

    def __init__(self, total: int, done: int, failed: int, shown: bool):
        """Begins with ``done`` of the ``total`` cases, which an earlier run computed; ``failed`` of these have failed.

        Without ``shown`` cases are only counted.
        """
        self.total, self.done, self.failed = total, done, failed
        self._shown = shown
        self._start = time.monotonic()
        # Time of the next line.
        self._line_at = self._start + _LINE_SECONDS
        # Cases of earlier sweeps, which the rate leaves out.
        self._done_before = done
        self._bar: tqdm[object] | None = None
        if shown and sys.stderr.isatty():
            self._bar = tqdm(
                total=total, initial=done, unit="case", delay=_BAR_DELAY_SECONDS, file=sys.stderr, leave=False
            )

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.close()

    def advance(self, done: int, failed: int) -> None:
        """Adds ``done`` finished cases, ``failed`` of which failed."""
        self.done += done
        self.failed += failed
        if self._bar is not None:
            if self.failed:
                self._bar.set_postfix_str(f"{self.failed} failed", refresh=False)
            self._bar.update(done)
        elif self._shown and time.monotonic() > self._line_at:
            self._line_at = time.monotonic() + _LINE_SECONDS
            self._print_line()

    def _print_line(self) -> None:
        """Prints the numbers of cases, the rate of this run, and the time left at this rate.

        At least ``_LINE_SECONDS`` have passed since the start.
        """
        rate = (self.done - self._done_before) / (time.monotonic() - self._start)
        left = (self.total - self.done) / rate if rate > 0 else float("inf")
        print(
            f"{self.done} of {self.total} cases, {self.failed} failed, {rate:.3g} cases/s, about {left:.0f} s left",
            file=sys.stderr,
            flush=True,
        )
