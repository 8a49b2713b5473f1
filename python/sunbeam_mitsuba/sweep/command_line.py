"""``python -m sunbeam_mitsuba.sweep SPEC.toml``."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from pathlib import Path
from types import FrameType

from .cluster import kill_workers
from .errors import SweepError
from .run import plan, run
from .spec import read_spec

#: Exit code of a sweep in which some cases failed.
SOME_FAILED = 1
#: Exit code of a sweep that was refused or cannot continue.
REFUSED = 2
#: Exit code of an interrupted sweep: 128 plus the number of SIGINT, by convention.
INTERRUPTED = 130


def _parser() -> argparse.ArgumentParser:
    """The parser of the options."""
    parser = argparse.ArgumentParser(
        prog="python -m sunbeam_mitsuba.sweep",
        description="Computes figures and pictures of many surfaces under many settings; goes on where it was stopped.",
        epilog="Exit status: 0, 1 where some cases failed, 2 with one line that says what is wrong, 130 on Ctrl-C.",
    )
    add = parser.add_argument
    add("spec", type=Path, metavar="SPEC.toml", help="what is wanted of which surfaces")
    add("-o", "--output", type=Path, metavar="FOLDER", help="where results go, instead of what the specification says")
    add("--scheduler", metavar="ADDRESS", help="a Dask scheduler such as tcp://host:8786, instead of this machine")
    add("--workers", type=_positive(int), metavar="N", help="processes of this machine (default: one a core)")
    add("--memory", type=_positive(float), metavar="GB", help="memory of each of them (default: what is free, divided)")
    begin = parser.add_mutually_exclusive_group()
    begin.add_argument("--resume", action="store_true", help="keep the results that are there (the default)")
    begin.add_argument("--fresh", action="store_true", help="remove them and begin anew")
    add("--retry-failed", action="store_true", help="try the cases again that failed")
    add("--plan", action="store_true", help="say what it would take, and do nothing")
    return parser


def _positive(kind: type[int] | type[float]):  # type: ignore[no-untyped-def]
    """An argparse type: a finite number of type ``kind`` above zero."""

    def convert(text: str) -> float:
        value = kind(text)
        if not 0 < value < float("inf"):
            raise argparse.ArgumentTypeError(f"{text} is not above zero")
        return value

    convert.__name__ = kind.__name__
    return convert


def main(words: list[str] | None = None) -> int:
    """Runs the command line. Returns the exit code."""
    options = _parser().parse_args(words)
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        spec = read_spec(options.spec, options.output)
        if options.plan:
            planned = plan(spec, options.workers, options.memory)
            print(
                f"{planned.cases} cases of {planned.surfaces} surfaces; building the largest tables takes about "
                f"{planned.largest_gb:.2f} GB; {planned.workers} workers with {planned.worker_gb:.1f} GB each; "
                f"results go to {spec.output}"
            )
            return 0
        outcome = run(
            spec,
            scheduler=options.scheduler,
            workers=options.workers,
            memory_gb=options.memory,
            fresh=options.fresh,
            retry_failed=options.retry_failed,
        )
    except SweepError as error:
        print(f"sweep: {error}", file=sys.stderr)
        return REFUSED
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        print("\nsweep: stopped; the same command goes on with the rest", file=sys.stderr, flush=True)
        # Dask restarts workers that the interruption killed; once alone, these would print tracebacks.
        kill_workers()
        # Dask's threads may still wait for connections that will never answer.
        os._exit(INTERRUPTED)
    print(
        f"{outcome.cases} cases, {outcome.failed} failed, {outcome.seconds:.1f} s: {outcome.folder}"
        + ("; the column error says why, and --retry-failed tries them again" if outcome.failed else "")
    )
    return SOME_FAILED if outcome.failed else 0


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt
