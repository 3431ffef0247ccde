"""The one root of every error that a user of Tactful can cause."""


class TactfulError(Exception):
    """What went wrong, where, and what to do about it, in one line.

    Every package derives its own errors from this class and gives them fields, so that a caller can act on the data
    and the command line can print the message and exit with 2.
    """
