"""The path tracer and the realtime renderer held against each other: `python -m mitsuba_scenes.crosscheck`."""
