"""The take formats of usdface, each read by the module that is named after it.

Loads no library, so that help texts can list them.
"""

import os
import re
from collections.abc import Callable
from pathlib import Path

from usdface.errors import InputError
from usdface.formats import TakeReader
from usdface.io.format_table import FormatTable
from usdface.io.images.sequence import IMAGE_SUFFIXES, MOVIE_SUFFIXES, may_be_images
from usdface.lazy import lazy_function

__all__ = ["TAKE_READERS"]

_MARKER_OPTIONS = ("units", "up_axis", "rate", "dimension", "image_size", "focal_length")
_TEXT_TABLES = (".csv", ".tsv", ".txt")
_FIRST_BYTES = 1 << 15  # more than the longest header below, that of 478 landmarks
_TRACKS = ("rate", "dimension", "image_size", "focal_length")
_SCORED = (*_TRACKS, "confidence")  # of programs that say how sure they are


def _matches(pattern: str) -> Callable[[Path], bool]:
    """Return a test for text files that begin like this; case and line ends do not count."""
    expression = re.compile(pattern, re.IGNORECASE)

    def matches(path: Path) -> bool:
        try:
            with path.open("rb") as file:
                first = file.read(_FIRST_BYTES).decode("utf-8-sig", errors="replace")
        except OSError as error:
            raise InputError(
                f"{path} cannot be read: {error.strerror}", "FILE_UNREADABLE"
            ) from error
        first = first.replace("\r\n", "\n").replace("\r", "\n").lstrip()
        return expression.match(first) is not None

    return matches


def _is_folder_of_tracks(path: Path) -> bool:
    """Return whether a folder holds CSV files and nothing else."""
    with os.scandir(path) as entries:
        names = [entry.name for entry in entries if not entry.name.startswith(".")]
    return bool(names) and all(name.lower().endswith(".csv") for name in names)


def _reader(
    name: str,
    suffixes: tuple[str, ...],
    function: str,
    options: tuple[str, ...] = _MARKER_OPTIONS,
    begins: str = "",
    module: str = "",
) -> TakeReader:
    return TakeReader(
        name=name,
        suffixes=suffixes,
        options=options,
        sniff=_matches(begins) if begins else None,
        read=lazy_function(
            f"usdface.io.takes.{module or function.removeprefix('read_')}", function
        ),
    )


# 2D tracks of other programs. Names of trackers may have blanks in them, numbers of samples not.
_TRACK_READERS = (
    _reader(
        "3DEqualizer 4 text",
        (".txt",),
        "read_3de4",
        _TRACKS,
        r"\d+[ \t]*\n[^\n\"]*\n[ \t]*\d+[ \t]*\n[ \t]*\d+[ \t]*(\n|$)",
        "equalizer",
    ),
    _reader(
        "3DEqualizer 3 text",
        (".txt",),
        "read_3de3",
        _TRACKS,
        r"//[ ]*3de multiple tracking curves",
        "equalizer",
    ),
    _reader(
        "PFMatchit text",
        (".txt",),
        "read_pftrack",
        _TRACKS,
        r'(?:#[^\n]*\n|[ \t]*\n)*"[^"\n]*"[ \t]*\n\s*(?:"[^"\n]*"|\d+)[ \t]*(\n|$)',
    ),
    _reader("Shake text, Nuke CameraTracker", (".txt",), "read_shake", _SCORED, r"trackname[ \t]"),
    _reader(
        "SynthEyes 2-D paths",
        (".txt",),
        "read_syntheyes",
        _TRACKS,
        r"[^#\s,;][^\n,;]*[ \t]-?\d+[ \t]+-?\d*\.\d+[ \t]+-?\d*\.\d+([ \t]+\d+)?[ \t]*(\n|$)",
    ),
    _reader(
        "boujou text", (".txt",), "read_boujou", _TRACKS, r"(?:#[^\n]*\n)*#[ ]*(boujou|track_id)"
    ),
    _reader("Maya Live", (".txt",), "read_maya_live", _TRACKS, r"#\s*size\s+\d+\s+\d+"),
    _reader(
        "After Effects keyframe data",
        (".txt",),
        "read_after_effects",
        _TRACKS,
        r"adobe after effects[^\n]*keyframe data",
    ),
    _reader("PFTrack", (".2dt",), "read_pftrack", _TRACKS),
    _reader("MatchMover", (".rz2",), "read_matchmover", _SCORED),
    _reader("Nuke script", (".nk",), "read_nuke", _TRACKS),
    _reader("mmSolver", (".uv",), "read_mmsolver", _SCORED),
    _reader("DeepLabCut CSV", (".csv",), "read_deeplabcut", _SCORED, r'"?scorer"?[,;\t]'),
    _reader("SLEAP CSV", (".csv",), "read_sleap", _SCORED, r'"?track"?[,;\t]"?frame_idx'),
    _reader(
        "OpenFace CSV",
        (".csv",),
        "read_openface",
        _SCORED,
        r'"?\s*frame["\s]*[,;\t](["\s]*face_id["\s]*[,;\t])?(["\s]*timestamp["\s]*[,;\t])?'
        r'["\s]*confidence["\s]*[,;\t]["\s]*success',
    ),
    _reader("MediaPipe JSON", (".json",), "read_mediapipe", _TRACKS),
    _reader(
        "MediaPipe CSV",
        (".csv",),
        "read_mediapipe",
        _TRACKS,
        r"(?=[^\n]*\blandmark(_index|_idx|_id|_name)?[,;\t])[^\n]*[,;\t]x[,;\t]y\b"
        r"|[^\n]*(\bx_?4[67]7\b|(\b|_)4[67]7[._]x\b)",
    ),
    TakeReader(
        name="folder of Blender's tracks",
        options=_TRACKS,
        folder=True,
        sniff=_is_folder_of_tracks,
        read=lazy_function("usdface.io.takes.blender_tracks", "read_blender_tracks"),
    ),
)

TAKE_READERS = FormatTable(
    TakeReader,
    "usdface.takes",
    ("take files", "read"),
    (
        _reader("C3D", (".c3d",), "read_c3d"),
        _reader("TRC", (".trc",), "read_trc"),
        _reader("BVH", (".bvh",), "read_bvh"),
        _reader("marker CSV", _TEXT_TABLES, "read_csv_markers"),
        _reader("Motive CSV", _TEXT_TABLES, "read_motive", begins=r'"?format version"?[,;\t]'),
        _reader(
            "Vicon CSV",
            _TEXT_TABLES,
            "read_vicon",
            begins=r'"?(trajectories|model outputs|devices|joints|segments|events|analog)[",;\t]*\n'
            r'"?\d+(\.\d+)?[",;\t]*(hz[",;\t]*)?\n',
        ),
        _reader(
            "Qualisys TSV",
            _TEXT_TABLES,
            "read_qualisys",
            begins=r"(file_version\t[^\n]*\n)?no_of_frames\t",
        ),
        _reader(
            "Live Link Face CSV",
            _TEXT_TABLES,
            "read_livelink",
            options=("rate",),
            begins=r'"?timecode"?[,;\t]"?blendshapecount',
        ),
        _reader("TRC as CSV", _TEXT_TABLES, "read_trc", begins=r"pathfiletype"),
        *_TRACK_READERS,
        _reader("USD", (".usd", ".usda", ".usdc"), "read_usd_take", options=()),
        TakeReader(
            name="images of painted dots",
            suffixes=(*IMAGE_SUFFIXES, *MOVIE_SUFFIXES),
            options=("rate", "focal_length", "dots", "names", "fixes", "bind", "rig"),
            folder=True,
            sniff=may_be_images,
            read=lazy_function("usdface.io.images.footage", "read_image_take"),
        ),
    ),
    remedies={
        **dict.fromkeys((".glb", ".gltf", ".vrm"), "`usdface rig` reads a character"),
        **dict.fromkeys((".obj", ".ply"), "`usdface rig` reads a character, a folder of them"),
        ".fbx": "export its markers as C3D, TRC or BVH",
    },
)
