"""The error that is reported to the user."""


class UserError(Exception):
    """An error in the user's input. Its message is one line that says what is wrong, where, and what to do.

    Scripts print the message and stop. Any other exception is a bug in the program and keeps its traceback.
    Line breaks that a message quotes from a file are written as escape sequences.
    """

    def __init__(self, message: str) -> None:
        breaks = [character for character in set(message) if len(f"a{character}b".splitlines()) > 1]
        super().__init__(message.translate({ord(one): repr(one)[1:-1] for one in breaks}))


class MissingFileError(UserError):
    """The user named a file or folder that does not exist.

    Attributes
    ----------
    path : the path as the user wrote it.
    """

    def __init__(self, path: str, message: str) -> None:
        super().__init__(message)
        self.path = path
