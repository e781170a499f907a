"""What can go wrong, sorted by who must act.

The policy: a message is one line that says what was found, what was expected and what to do, and names the file,
the parameter or the stage. Finding nothing is a result, not an error: an empty plan is returned, with a note that
names the stage that came up empty. What escapes as any other exception is our bug.

=====================  =======================================================  =========
exception              who must act                                             exit code
=====================  =======================================================  =========
`InputError`           the user: the file is wrong, missing or unreadable       2
`ParameterError`       the user: an argument is out of its range                2
`OutputError`          the user: the place to write to is wrong or full         2
`MissingExtraError`    the user: an optional dependency is not installed        2
=====================  =======================================================  =========
"""


class AsBuiltError(Exception):
    """Base of everything that asbuilt raises on purpose."""


class InputError(AsBuiltError):
    """A file that cannot be read as what it claims to be; the message names it."""


class ParameterError(AsBuiltError, ValueError):
    """An argument out of its range; the message gives the range."""


class OutputError(AsBuiltError):
    """A place that cannot be written to, or a suffix that no exporter knows."""


class MissingExtraError(AsBuiltError, ImportError):
    """An optional dependency is missing; the message gives the command that installs it."""


def told(error: Exception) -> str:
    """What another program's or Python's error says of a file, without reciting the file.

    >>> told(KeyError("features"))
    "KeyError('features')"
    """
    text = str(error) if isinstance(error, UnicodeError) else repr(error)
    return text if len(text) <= 200 else f"{text[:200]}..."
