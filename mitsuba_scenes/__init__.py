"""Scenes with the `diffraction` plugin in Mitsuba 3: the snake, a laboratory, the demo, and the comparison of renderers."""
