"""Checks and timings of a machine with an NVIDIA card: `python -m benches.gpu`, or `make bench-gpu`.

Each part runs in a process of its own with a time limit, so that one which crashes or hangs costs no other part.
Without a card the same code makes a dry run: `llvm_ad_*` in place of `cuda_ad_*`, the software adapter, small sizes.

Needed are NumPy, Mitsuba with the plugin, and the command `sunbeam`; `SUNBEAM_MITSUBA`, `SUNBEAM` and `SUNBEAM_DATA`
name the plugin's folder, the command and the folder of measured data where they are not those of the checkout.
"""
