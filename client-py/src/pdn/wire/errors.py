"""The one error of this package."""

from .names import Code


class WireError(ValueError):
    """Something cannot be read or written as the contract says.

    `code` is the code under which the service refuses the same.
    """

    def __init__(self, code: Code, message: str) -> None:
        super().__init__(message)
        self.code = code
        self.message = message


def invalid(message: str) -> WireError:
    """An error of what cannot be read."""
    return WireError(Code.INVALID, message)
