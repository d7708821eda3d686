"""The error that is reported to the user."""


class UserError(Exception):
    """An error in the user's input. Its message is one line that says what is wrong, where, and what to do.

    Scripts print the message and stop. Any other exception is a bug in the program and keeps its traceback.
    """


class MissingFileError(UserError):
    """The user named a file or folder that does not exist.

    Attributes
    ----------
    path : the path as the user wrote it.
    """

    def __init__(self, path: str, message: str) -> None:
        super().__init__(message)
        self.path = path
