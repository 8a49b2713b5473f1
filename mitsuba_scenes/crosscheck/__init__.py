"""Comparison of the path tracer and the realtime renderer: `python -m mitsuba_scenes.crosscheck`."""
