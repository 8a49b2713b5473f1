"""The exception of the package's functions."""


class SunbeamError(ValueError):
    """A refused parameter, array or file, or a missing package that reads the file.

    The message names the fault, and the accepted values or the remedy if there are any.
    """
