"""The snake rendered in Mitsuba 3 with the `diffraction` plugin: scene, command line, demonstration."""
