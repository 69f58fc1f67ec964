"""The error tree. Each message is one line: problem, place, expected and found, remedy.

::

    UsdFaceError
    |- InputError     a file, prim or setting from outside cannot be used
    |- SchemaError    the USD schemas cannot be registered or are not there
    |- SolveError     the numbers do not determine a solution
    |- OutputError    a result cannot be written
    |- PluginError    a format of another package cannot be used
    `- Cancelled      the caller ended the job

Each carries a stable `code`, as findings do (`usdface.findings`), for programs and reports;
one code has one meaning for ever. Nothing else leaves the library: errors of the libraries
below are caught in ``usdface.io`` and raised again as one of these, ``from`` the original.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from usdface.plain_text import plain

__all__ = [
    "ERROR_CODES",
    "Cancelled",
    "InputError",
    "OutputError",
    "PluginError",
    "SchemaError",
    "SolveError",
    "UsdFaceError",
    "did_you_mean",
    "errors_at",
    "how_to_install",
    "unreadable",
]

_LONGEST = 800  # characters of a message, which may quote a file

ERROR_CODES: dict[str, str] = {
    "INPUT_UNUSABLE": "a file, prim or setting cannot be used as it is",
    # files
    "FILE_UNREADABLE": "a file is missing, may not be read, or is of another kind",
    "FILE_KIND_UNKNOWN": "files of this kind are not read, or not written",
    "FILE_CUT_OFF": "a file ends before its header says, or within a row of its table",
    "SCHEMA_BROKEN": "a file does not follow the schema of its format",
    "ROW_WRONG": "a line of a text file has the wrong content",
    "COLUMNS_WRONG": "a table lacks a column, or has one twice",
    "VALUES_WRONG": "numbers are missing, NaN or infinite",
    "TOO_LARGE": "a file, or the memory that it needs, is too large",
    "SETTING_WRONG": "a setting is not one of its choices, or outside its range",
    "UNIT_UNKNOWN": "a unit of length that is not known",
    "AXIS_UNKNOWN": "an up axis that is neither Y nor Z",
    "NAME_REPEATED": "a name occurs twice where it must not",
    "DEFAULT_PRIM_MISSING": "a USD file that is to be referenced has no defaultPrim",
    # glTF
    "EXTENSION_UNSUPPORTED": "a glTF requires an extension that is not decoded here",
    "URI_OUTSIDE": "a reference leads outside the folder of the file, or to the net",
    "ACCESSOR_WRONG": "count, offset, stride or type of glTF data do not fit its buffer",
    "NODES_CYCLIC": "the nodes of a glTF are no tree",
    # rigs
    "FACE_MISSING": "there is no mesh, or no SkelRoot above it",
    "SHAPES_MISSING": "a rig has no blend shapes",
    "MESH_UNKNOWN": "a rig has no mesh of that name, or several faces and none is named",
    "NEUTRAL_UNKNOWN": "the neutral mesh of a folder cannot be determined",
    "SKIN_MISSING": "the blend shapes move no visible surface that markers could be on",
    "SHAPE_UNKNOWN": "a named blend shape is not on the rig",
    "JOINT_UNKNOWN": "the joint that is to move the head does not exist, or there are several",
    "TARGETS_UNEQUAL": "morph targets do not fit their mesh",
    "TOPOLOGY_DIFFERS": "faces and points do not belong together",
    "POINT_INDICES_OUTSIDE": "a point index is outside the mesh",
    "WEIGHTS_LENGTH_WRONG": "the number of weights is not that of the blend shapes",
    # takes and bindings
    "TAKE_EMPTY": "a take has no frames, or no markers or curves",
    "TAKE_SHORT": "a take has too few frames",
    "TAKE_STILL": "no marker moves in the whole take",
    "TAKE_KIND_WRONG": "a take is of the wrong kind: 3D markers, 2D markers or weights",
    "TIMES_WRONG": "times are missing or do not increase",
    "MARKER_UNKNOWN": "a named marker is not in the take, or not bound to the rig",
    "MARKERS_TOO_FEW": "there are too few markers",
    "BINDING_MISSING": "no marker is bound to the rig",
    "BINDING_OTHER_MESH": "a binding was made for a mesh with other points or faces",
    "BINDING_UNSURE": "most proposed vertices are unsure",
    "VERTEX_OUTSIDE": "a marker is bound to a vertex that the mesh does not have",
    "FRAMES_OUTSIDE": "neutral, peak or pinned frames are not in the take",
    "SHOT_INCOMPLETE": "a file is no shot, or a target of the shot does not exist",
    "SHOT_AS_RIG": "a shot, or a result of one, is named as the rig of a new shot",
    "SOLVE_UNDETERMINED": "the numbers do not determine a solution",
    "RESULT_UNUSABLE": "the result is not usable, and is refused as requested; nothing is written",
    # formats of other packages
    "PLUGIN_FAILED": "a format of another package cannot be loaded, fails or returns nonsense",
    "PLUGIN_CONFLICT": "formats of several packages fit one file",
    "HOOK_FAILED": "a hook of another package cannot be loaded, fails or returns nonsense",
    # the program
    "SCHEMAS_LATE": "the usdface schemas are missing or come too late",
    "CANCELLED": "the caller ended the job; nothing is written",
    "OUTPUT_UNWRITABLE": "a result cannot be written; existing files are unchanged",
}


class UsdFaceError(Exception):
    """Any error that usdface raises on purpose.

    Parameters
    ----------
    message : str
        One line.
    code : str, optional
        A key of `ERROR_CODES`; else that of the class.

    Examples
    --------
    >>> try:
    ...     usdface.read_rig("missing.glb")
    ... except usdface.UsdFaceError as error:
    ...     print(error.code)
    FILE_UNREADABLE
    """

    default_code = "INPUT_UNUSABLE"

    def __init__(self, message: str, code: str = "") -> None:
        super().__init__(plain(message, _LONGEST))
        self.code = code or self.default_code


class InputError(UsdFaceError):
    """A file, prim or setting from outside cannot be used as it is.

    Parameters
    ----------
    message : str
        One line.
    code : str, optional
        A key of `ERROR_CODES`; else that of the class.

    Examples
    --------
    >>> usdface.read_take("missing.c3d")
    Traceback (most recent call last):
    usdface.errors.InputError: ...missing.c3d...
    """


class SchemaError(UsdFaceError):
    """The usdface USD schemas are missing or cannot be registered any more.

    Parameters
    ----------
    message : str
        One line.
    code : str, optional
        A key of `ERROR_CODES`; else that of the class.

    Examples
    --------
    >>> usdface.SchemaError("the schemas come too late").code
    'SCHEMAS_LATE'
    """

    default_code = "SCHEMAS_LATE"


class SolveError(UsdFaceError):
    """The given numbers do not determine a solution.

    Parameters
    ----------
    message : str
        One line.
    code : str, optional
        A key of `ERROR_CODES`; else that of the class.

    Examples
    --------
    >>> usdface.SolveError("two markers for three poses").code
    'SOLVE_UNDETERMINED'
    """

    default_code = "SOLVE_UNDETERMINED"


class OutputError(UsdFaceError):
    """A result cannot be written; existing files are unchanged.

    Parameters
    ----------
    message : str
        One line.
    code : str, optional
        A key of `ERROR_CODES`; else that of the class.

    Examples
    --------
    >>> usdface.make_take("examples/performance.trc", "examples/performance.trc")
    Traceback (most recent call last):
    usdface.errors.OutputError: ...would be overwritten...
    """

    default_code = "OUTPUT_UNWRITABLE"


class PluginError(UsdFaceError):
    """A reader, export target or hook of another package cannot be used; the message names it.

    Parameters
    ----------
    message : str
        One line.
    code : str, optional
        A key of `ERROR_CODES`; else that of the class.

    Examples
    --------
    >>> usdface.PluginError("acme-xyz cannot be loaded").code
    'PLUGIN_FAILED'
    """

    default_code = "PLUGIN_FAILED"


class Cancelled(UsdFaceError):
    """The caller ended the job: raise it in the callback `on_progress`. Nothing is written.

    Parameters
    ----------
    message : str
        One line.
    code : str, optional
        A key of `ERROR_CODES`; else that of the class.

    Examples
    --------
    >>> def stop(step: usdface.Step) -> None:
    ...     raise usdface.Cancelled
    >>> usdface.process("examples/shot.usda", on_progress=stop)
    Traceback (most recent call last):
    usdface.errors.Cancelled: cancelled
    """

    default_code = "CANCELLED"

    def __init__(self, message: str = "cancelled", code: str = "") -> None:
        super().__init__(message, code)


def unreadable(error: OSError) -> InputError:
    """Return the error for a file that the system refuses to look at."""
    return InputError(f"{error.filename} cannot be read: {error.strerror}", "FILE_UNREADABLE")


def how_to_install(extra: str) -> str:
    """Return the command that adds an extra of this package, for a message."""
    return f"pip install 'usdface[{extra}]', in a clone '.[{extra}]'"


@contextmanager
def errors_at(place: object) -> Iterator[None]:
    """Name a file, prim or entry before the message of an InputError that a block raises."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{place}: {error}", error.code) from error


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return "; did you mean X?" with the known name X nearest to an unknown one, "" if none is."""
    from difflib import get_close_matches  # only where something is wrong

    near = get_close_matches(name, list(known), 1)
    return f"; did you mean {near[0]}?" if near else ""
