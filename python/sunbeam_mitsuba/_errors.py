"""The exception of what the package refuses."""


class SunbeamError(ValueError):
    """A parameter, an array or a file that is refused; the message names what is wrong and what is accepted."""
