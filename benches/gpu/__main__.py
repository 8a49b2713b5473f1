"""The command line: `python -m benches.gpu [PART ...]`.

The command starts a process for each part (parts.py): the same command with the hidden option `--rows`, which runs the
part and writes its results.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

from mitsuba_scenes.crosscheck import cases
from mitsuba_scenes.environment import REPOSITORY, SetupError

from . import checks, machine, supervisor
from .parts import PARTS
from .plan import CARD, DRY_RUN
from .supervisor import Run
from .surfaces import write_synthetic_scan

# File for the results of a run with a card. The generators of the documentation (docs/figures) read it.
RESULTS = REPOSITORY / "docs" / "data" / "gpu.json"
# File for the results of a dry run.
DRY_RESULTS = REPOSITORY / "out" / "bench" / "gpu-dry-run.json"
# Folder for pictures of the realtime renderer.
PICTURES = REPOSITORY / "out" / "bench" / "gpu"
# Time limit of a whole run in seconds, above the sum of the expected times that `--list` prints. A larger limit lets a
# slower machine finish; a smaller one bounds the time for which a rented machine is needed.
TIME_S = 480.0


def parse(words: list[str] | None) -> tuple[argparse.ArgumentParser, argparse.Namespace]:
    """The parser and the options that it reads from the arguments `words`, by default those of the process."""
    parser = argparse.ArgumentParser(
        prog="python -m benches.gpu",
        description="Checks and timings of a machine with an NVIDIA card; a dry run where there is none.",
        epilog="Exit status: 0 where everything passed, 1 where a part failed or was not run, 2 for a wrong argument "
        "or without the command sunbeam.",
    )
    add = parser.add_argument
    add("parts", nargs="*", metavar="PART", help="part to run, all by default; --list shows their names")
    add(
        "--dry-run", action="store_true", help="run llvm_ad_* and the software adapter at small sizes, even with a card"
    )
    add(
        "--compare",
        action="store_true",
        help="compare the pictures in --pictures, drawn by a card on another machine, with the software adapter's",
    )
    add("--list", action="store_true", help="print the parts with their time limits")
    add(
        "--json",
        type=Path,
        help=f"file for the results (docs/data/{RESULTS.name}; dry run: out/bench/{DRY_RESULTS.name})",
    )
    add("--pictures", type=Path, default=PICTURES, help="folder for the card's pictures")
    add("--seconds", type=float, default=TIME_S, help="time limit of the whole run in s (%(default).0f)")
    # File for the results of one part. The supervisor passes the option to the part's process.
    add("--rows", type=Path, help=argparse.SUPPRESS)
    return parser, parser.parse_args(words)


def main(words: list[str] | None = None) -> int:
    """Runs the command; returns its exit status, which `--help` describes."""
    parser, options = parse(words)
    for name in options.parts:
        if name not in PARTS:
            parser.error(f"unknown part {name!r}; available: {', '.join(PARTS)}")
    if options.compare and (options.dry_run or options.parts not in ([], ["pictures"])):
        parser.error("--compare runs the part pictures alone, without --dry-run")
    if options.list:
        print("\n".join(listed()))
        return 0
    if options.rows:
        return run_child(options)
    try:
        return run(options)
    except SetupError as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return 2


def listed() -> list[str]:
    """The text of `--list`: a line for each part, and one for their sum."""
    lines = [
        f"{name:16} {part.estimate_s:4} s expected, {part.limit_s:4} s at most  {part.title}"
        for name, part in PARTS.items()
    ]
    expected = sum(part.estimate_s for part in PARTS.values())
    return [*lines, f"{'all':16} {expected:4} s expected on an H100 with 16 cores, {TIME_S:4.0f} s at most"]


def run_child(options: argparse.Namespace) -> int:
    """Runs the only part of `options.parts` in this process and appends its results to the file `options.rows`.

    Returns the exit status.
    """
    # Sizes of the checks; with --compare no picture is drawn.
    plan = DRY_RUN if options.dry_run else replace(CARD, draws=not options.compare)
    name = options.parts[0]
    return 0 if checks.run(PARTS[name].checks(plan, options.pictures), options.rows) else checks.FAILED


def run(options: argparse.Namespace) -> int:
    """Runs the parts in their own processes and writes the results; returns the exit status."""
    # With --compare the card's pictures exist already, so this machine needs no card.
    card = None if options.compare else machine.card()
    dry = options.dry_run or (card is None and not options.compare)
    if dry and not options.dry_run:
        print("nvidia-smi finds no card: a dry run with llvm_ad_* and the software adapter", flush=True)
    data = provide_scan(options.pictures)
    about = machine.described(None if dry else card)
    for key, value in about.items():
        print(f"{key}: {value}", flush=True)
    print(flush=True)
    # Options of the parts' processes.
    flags = [flag for flag, given in (("--dry-run", dry), ("--compare", options.compare)) if given]
    names = ["pictures"] if options.compare else options.parts or list(PARTS)
    file = options.json or (DRY_RESULTS if dry else RESULTS)
    results = supervisor.run_all(
        names, Run(tuple(flags), options.pictures.resolve(), time.monotonic() + options.seconds, data)
    )
    # The file keeps its results of other parts, unless they are another card's.
    supervisor.write(supervisor.gathered(results, about, file), file)
    wrong = [f"{name} {result['status']}" for name, result in results.items() if result["status"] != "passed"]
    print(f"wrote {file}\n{', '.join(wrong) or 'every part passed'}")
    return 1 if wrong else 0


def provide_scan(folder: Path) -> Path | None:
    """Writes a synthetic scan below `folder` if the measured one is missing.

    Returns the folder of its data, which the processes of the parts get as `SUNBEAM_DATA`; `None` with a measured scan.
    """
    if cases.SCAN.exists():
        return None
    print(f"no scan at {cases.SCAN} (SUNBEAM_DATA names the data): a synthetic one stands in for it", flush=True)
    write_synthetic_scan(folder / "data" / "afm")
    return (folder / "data").resolve()


if __name__ == "__main__":
    sys.exit(main())
