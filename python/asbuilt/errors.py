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

from __future__ import annotations

import json


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


#: What Python says of values that do not suit, and what that means for a file that holds them.
_IN_WORDS = (
    (UnicodeError, "", "bytes that are no text in UTF-8"),
    (RecursionError, "", "lists within lists that do not end"),
    (OverflowError, "", "a number that is too large"),
    (ValueError, "digits", "a number that is too large"),
    (IndexError, "", "a list that is too short"),
    (ValueError, "unpack", "a list of another length"),
    (ValueError, "could not convert", "text instead of a number"),
    ((TypeError, AttributeError), "", "a value of another kind"),
)


def told(error: Exception) -> str:
    """What a file holds that made Python raise an error, in words for who has the file, without reciting it.

    >>> told(KeyError("features"))
    "nothing called 'features'"
    """
    if isinstance(error, json.JSONDecodeError):
        return f"no JSON from line {error.lineno}, column {error.colno} on" if error.doc.strip() else "an empty file"
    if isinstance(error, KeyError):
        return f"nothing called {str(error.args[0])[:60]!r}"
    text = str(error)
    words = (words for kind, part, words in _IN_WORDS if isinstance(error, kind) and part in text)
    return next(words, text if len(text) <= 200 else f"{text[:200]}...")
