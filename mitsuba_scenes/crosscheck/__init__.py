"""Comparison of the path tracer and the realtime renderer: `python -m mitsuba_scenes.crosscheck` (docs/crosscheck.md).

Checks (a) same_points.py: values at equal points; (b) same_picture.py: rendered pictures; (c) methods.py: every
realtime method. Checks (a) and (b) have negative controls: comparisons with a deliberate error, which must fail.
"""
