"""Comparison of the path tracer and the realtime renderer: `python -m mitsuba_scenes.crosscheck` (docs/crosscheck.md).

Both renderers draw the snake with the same skins, camera and directional sun. A *skin* is a relief on the snake's
surface. Three checks, run by run.py:

(a) same_points.py: values at the same points of the surface (same_colours.py for gratings by Maxwell's equations);
(b) same_picture.py: rendered pictures;
(c) methods.py: every realtime method, reported without limits.

Checks (a) and (b) have negative controls: comparisons with a deliberate error, which must fail.
"""
