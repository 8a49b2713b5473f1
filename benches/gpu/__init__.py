"""Checks and timings of a machine with an NVIDIA card: `python -m benches.gpu`, or `make bench-gpu`.

Each part runs in its own process with a time limit, so a crash or a hang affects no other part. Without a card the same
code makes a dry run: `llvm_ad_*` in place of `cuda_ad_*`, the software adapter, small sizes.

A run needs NumPy, Mitsuba with the plugin, and the command `sunbeam`. `SUNBEAM_MITSUBA`, `SUNBEAM` and `SUNBEAM_DATA`
name the plugin's folder, the command and the folder of measured data; by default they are those of the checkout.
"""
