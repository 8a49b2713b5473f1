"""Checks and timings of a machine with an NVIDIA card: `python -m benches.gpu`, or `make bench-gpu`.

A run has parts (parts.py), and a part has checks. Each part runs in its own process with a time limit (supervisor.py),
so a crash or a hang affects no other part. Without a card, or with `--dry-run`, the same code makes a dry run
(plan.py): Mitsuba's `llvm_ad_*` in place of `cuda_ad_*`, wgpu's software adapter in place of the card's, small sizes.

Terms: a *kind* is the end of a variant's name, such as `rgb` or `spectral_polarized`. The *checked variant* is a
variant for the card, or for LLVM in a dry run. A *question* is one set of arguments of a BSDF's methods: a pair of
directions, wavelengths and random numbers (questions.py). A *surface* is a set of BSDF parameters with a name
(surfaces.py). A *negative control* is a check with a deliberate error, which it must detect.

A run needs NumPy, Mitsuba with the plugin, and the command line tool `sunbeam`. `SUNBEAM_MITSUBA`, `SUNBEAM` and
`SUNBEAM_DATA` name the plugin's folder, the tool and the folder of measured data. The defaults are in or beside the
checkout.
"""
