"""The error tree. Each is one clear line: what, where, expected and found, what to do.

::

    UsdFaceError
    |- InputError     a file, prim or setting from outside cannot be used
    |- SchemaError    the USD schemas cannot be registered or are not there
    |- SolveError     the numbers do not determine an answer
    `- OutputError    a result cannot be written

Nothing else leaves the library: errors of the libraries below are caught at the
border (``usdface.io``) and raised again as one of these, ``from`` the original.
"""

__all__ = ["InputError", "OutputError", "SchemaError", "SolveError", "UsdFaceError"]


class UsdFaceError(Exception):
    """Any error that usdface raises on purpose."""


class InputError(UsdFaceError):
    """A file, prim or setting from outside cannot be used as it is."""


class SchemaError(UsdFaceError):
    """The usdface USD schemas are missing or cannot be registered any more."""


class SolveError(UsdFaceError):
    """The given numbers do not determine an answer."""


class OutputError(UsdFaceError):
    """A result cannot be written; what was there before is still there."""
