"""The exception of the package's functions."""


class SunbeamError(ValueError):
    """A refused parameter, array or file. The message names the fault and the accepted values."""
