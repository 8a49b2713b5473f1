"""Scenes for the `diffraction` plugin in Mitsuba 3: snake, laboratory, demo, and the comparison of renderers."""
