"""The one kind of error that a user is meant to read."""


class UserError(Exception):
    """A mistake in what the user gave: its message is one line with what is wrong, where, and what to do.

    Scripts print the message and stop; any other exception is a defect of the program and keeps its traceback.
    """
