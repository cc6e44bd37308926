"""The one root of every exception that Okiagari raises on purpose."""

from __future__ import annotations


class OkiagariError(Exception):
    """Root of all errors raised by Okiagari."""


class InputError(OkiagariError):
    """The user asked for something that cannot be done.

    The message is one line that names the file, the field, the value and what is allowed; the command line
    prints it as it is and exits with code 2.
    """


def one_line(error: object) -> str:
    """What an error says, without its line breaks."""
    return " ".join(str(error).split())


def with_kind(error: BaseException) -> str:
    """The same after the name of its class, for errors of code that is not ours."""
    return f"{type(error).__name__}: {one_line(error)}"
