"""The command line ``python -m sunbeam_mitsuba.sweep SPEC.toml``."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType

from .cluster import kill_workers
from .errors import SweepError
from .run import plan, run
from .spec import Spec, read_spec

#: Exit code of a sweep in which some cases failed.
SOME_FAILED = 1
#: Exit code of a sweep that was refused or cannot continue.
REFUSED = 2
#: Exit code of an interrupted sweep: 128 plus the number of SIGINT, by convention.
INTERRUPTED = 130

_WORKERS_HELP = (
    "processes on this machine (default: one per core, or fewer where memory is short); not used with --scheduler"
)
_MEMORY_HELP = "memory limit of each process (default: an equal part of the free memory); not used with --scheduler"


def _parser() -> argparse.ArgumentParser:
    """Makes the parser of the options."""
    parser = argparse.ArgumentParser(
        prog="python -m sunbeam_mitsuba.sweep",
        description="Computes figures and pictures of many surfaces under many settings; resumes after interruptions.",
        epilog="Exit status: 0, 1 where some cases failed, 2 after a refusal in one line, 130 on Ctrl-C or SIGTERM.",
    )
    add = parser.add_argument
    add("spec", type=Path, metavar="SPEC.toml", help="surfaces, settings and wanted figures")
    add("-o", "--output", type=Path, metavar="FOLDER", help="folder of the results, instead of the specification's")
    # A plan is for the memory of this machine, which a scheduler's workers need not share.
    place = parser.add_mutually_exclusive_group()
    place.add_argument("--scheduler", metavar="ADDRESS", help="compute on a Dask scheduler such as tcp://host:8786")
    add("--workers", type=_positive(int), metavar="N", help=_WORKERS_HELP)
    add("--memory", type=_positive(float), metavar="GB", help=_MEMORY_HELP)
    # `--resume` only states the default, so its value is never read.
    earlier = parser.add_mutually_exclusive_group()
    earlier.add_argument("--resume", action="store_true", help="keep the folder's results (the default)")
    earlier.add_argument("--fresh", action="store_true", help="remove the folder's results first")
    add("--retry-failed", action="store_true", help="compute failed cases again")
    place.add_argument("--plan", action="store_true", help="estimate the memory on this machine, and compute nothing")
    return parser


def _positive(kind: type[int] | type[float]) -> Callable[[str], float]:
    """Makes the converter of an argument that is a finite number of type ``kind`` above zero."""

    def convert(text: str) -> float:
        value = kind(text)
        if not 0 < value < float("inf"):
            raise argparse.ArgumentTypeError(f"{text} is not a finite number above zero")
        return value

    # Argparse names the converter in its message on other text: "invalid int value".
    convert.__name__ = kind.__name__
    return convert


def main(words: list[str] | None = None) -> int:
    """Runs the command line with the arguments ``words``, by default those of the process. Returns the exit code.

    An interruption ends the process with INTERRUPTED. Wrong arguments end it with status 2, by argparse.
    """
    options = _parser().parse_args(words)
    # Batch systems end a job by SIGTERM.
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        spec = read_spec(options.spec, options.output)
        if options.plan:
            _print_plan(spec, options.workers, options.memory)
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
        # A second signal would interrupt the clean-up.
        for interruption in (signal.SIGINT, signal.SIGTERM):
            signal.signal(interruption, signal.SIG_IGN)
        same_command = "the same command without --fresh" if options.fresh else "the same command"
        print(f"\nsweep: stopped; {same_command} goes on with the rest", file=sys.stderr, flush=True)
        # Dask restarts workers that the interruption killed. They would outlive this process and print tracebacks.
        kill_workers()
        # Dask's threads may wait for lost connections, and a normal exit would wait for these threads.
        os._exit(INTERRUPTED)
    print(
        f"{outcome.cases} cases, {outcome.failed} failed, {outcome.seconds:.1f} s: {outcome.folder}"
        + ("; the column error says why, and --retry-failed tries them again" if outcome.failed else "")
    )
    return SOME_FAILED if outcome.failed else 0


def _print_plan(spec: Spec, workers: int | None, memory_gb: float | None) -> None:
    """Prints the sweep's demand on this machine in one line."""
    planned = plan(spec, workers, memory_gb)
    print(
        f"{planned.cases} cases of {planned.surfaces} surfaces; building the largest tables takes about "
        f"{planned.largest_gb:.2f} GB; {planned.workers} workers with {planned.worker_gb:.1f} GB each; "
        f"results go to {spec.output}"
    )


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Handles SIGTERM like Ctrl-C."""
    raise KeyboardInterrupt
