"""The error tree. Each is one clear line: what, where, expected and found, what to do.

::

    UsdFaceError
    |- InputError     a file, prim or setting from outside cannot be used
    |- SchemaError    the USD schemas cannot be registered or are not there
    |- SolveError     the numbers do not determine an answer
    `- OutputError    a result cannot be written

Each carries a stable `code`, as findings do (`usdface.findings`), for programs and reports;
one code has one meaning for ever. Nothing else leaves the library: errors of the libraries
below are caught at the border (``usdface.io``) and raised again as one of these, ``from`` the
original.
"""

__all__ = ["ERROR_CODES", "InputError", "OutputError", "SchemaError", "SolveError", "UsdFaceError"]

ERROR_CODES: dict[str, str] = {
    "INPUT_UNUSABLE": "a file, prim or setting cannot be used as it is",
    "FILE_UNREADABLE": "a file is missing, may not be read, or is of another kind",
    "FILE_CUT_OFF": "a file ends before its header says",
    "SCHEMA_BROKEN": "a file does not follow the schema of its format",
    "EXTENSION_UNSUPPORTED": "a glTF requires an extension that is not decoded here",
    "URI_OUTSIDE": "a reference leads outside the folder of the file, or to the net",
    "ACCESSOR_WRONG": "count, offset, stride or type of glTF data do not fit its buffer",
    "NODES_CYCLIC": "the nodes of a glTF are no tree",
    "TARGETS_UNEQUAL": "morph targets do not fit their mesh",
    "WEIGHTS_LENGTH_WRONG": "the number of weights is not that of the blend shapes",
    "VALUES_WRONG": "numbers are missing, NaN or infinite",
    "TOO_LARGE": "a file, or what it asks for, is larger than can be",
    "FACE_MISSING": "there is no mesh, or no SkelRoot above it",
    "SCHEMAS_LATE": "the usdface schemas are missing or come too late",
    "SOLVE_UNDETERMINED": "the numbers do not determine an answer",
    "OUTPUT_UNWRITABLE": "a result cannot be written; what was there is still there",
}


class UsdFaceError(Exception):
    """Any error that usdface raises on purpose.

    Parameters
    ----------
    message : str
        One line.
    code : str, optional
        A key of `ERROR_CODES`; else that of the class.
    """

    default_code = "INPUT_UNUSABLE"

    def __init__(self, message: str, code: str = "") -> None:
        super().__init__(message)
        self.code = code or self.default_code


class InputError(UsdFaceError):
    """A file, prim or setting from outside cannot be used as it is."""


class SchemaError(UsdFaceError):
    """The usdface USD schemas are missing or cannot be registered any more."""

    default_code = "SCHEMAS_LATE"


class SolveError(UsdFaceError):
    """The given numbers do not determine an answer."""

    default_code = "SOLVE_UNDETERMINED"


class OutputError(UsdFaceError):
    """A result cannot be written; what was there before is still there."""

    default_code = "OUTPUT_UNWRITABLE"
