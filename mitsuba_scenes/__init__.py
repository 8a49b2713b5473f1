"""Scenes for the `diffraction` plugin in Mitsuba 3, and the programs that render and compare them.

Programs, `python -m mitsuba_scenes.NAME`: `render` (one picture of the snake), `demo` (pictures of all subjects, and a
report), `files` (scenes as XML files), and `crosscheck` (path tracer against realtime renderer). Libraries for tests
and documentation: `laboratory` (a beam, a flat sample and a screen) and `chi_square` (samples of a BSDF against its
density).
"""
