"""BVH motion: every joint and every end site becomes a marker, by forward kinematics."""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.takes.announced import compare_frames
from usdface.io.takes.raw_take import DEFAULTS, RawTake, check_size, finish_take
from usdface.io.takes.text_table import positive, read_text, refuse_cut_end
from usdface.io.takes.timing import nominal_rate
from usdface.options import TakeOptions
from usdface.takes import MarkerTake

__all__ = ["read_bvh"]

_AXES = {"x": 0, "y": 1, "z": 2}
_HEADER = re.compile(r"\s*Frames:\s*(\d{1,12})\s+Frame\s+Time:\s*(\S+)", re.IGNORECASE)
_CHANNELS = frozenset(axis + kind for axis in _AXES for kind in ("position", "rotation"))


@dataclass(frozen=True, slots=True)
class _Joint:
    name: str
    parent: int
    offset: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    channels: list[tuple[int, str]] = field(default_factory=list)  # column, "xposition" ...


def read_bvh(path: Path, options: TakeOptions = DEFAULTS) -> tuple[MarkerTake, list[Finding]]:
    """Read a BVH file: joints by name, end sites as `<parent>_end`.

    Rotations apply in the order in which the channels stand. A position channel replaces
    the same component of OFFSET, at the root and at any joint, as Blender and MotionBuilder
    read it. The format names no unit (centimetres are assumed) and no up axis.

    Raises
    ------
    InputError
        If the file is missing, not BVH, cut off within a frame, or its motion does not fit its
        hierarchy.
    """
    text = read_text(path)
    parts = re.split(r"^\s*MOTION\s*$", text, maxsplit=1, flags=re.MULTILINE)
    tokens = parts[0].split()
    if len(parts) < 2 or tokens[:1] != ["HIERARCHY"]:
        raise InputError(
            f"{path} is not a BVH file: expected HIERARCHY ... MOTION", "FILE_UNREADABLE"
        )
    joints, width = _hierarchy(path, tokens[1:])
    motion, step, findings = _motion(path, text, parts[1], width)
    check_size(path, len(motion), len(joints))
    raw = RawTake(
        path=path,
        labels=tuple(joint.name for joint in joints),
        positions=_forward_kinematics(joints, motion),
        rate=nominal_rate(np.array([0.0, step])) if step else 0.0,
        assumed_unit="cm",
        computed=True,
    )
    take, take_findings = finish_take(raw, options)
    return take, findings + take_findings


def _hierarchy(path: Path, tokens: list[str]) -> tuple[list[_Joint], int]:
    """Return the joints, parents first, and how many channels a frame has."""
    joints: list[_Joint] = []
    open_joints: list[int] = []
    width = 0
    words = iter(tokens)
    try:
        for word in words:
            if word in ("ROOT", "JOINT", "End"):
                parent = open_joints[-1] if open_joints else -1
                name = " ".join(iter(lambda: next(words), "{"))  # names may hold blanks
                if word == "End":
                    name = f"{joints[parent].name}_end"
                joints.append(_Joint(name, parent))
                open_joints.append(len(joints) - 1)
            elif word == "OFFSET":
                joints[open_joints[-1]].offset[:] = [float(next(words)) for _ in range(3)]
            elif word == "CHANNELS":
                kinds = [next(words).lower() for _ in range(int(next(words)))]
                if not _CHANNELS.issuperset(kinds):
                    raise ValueError(f"unknown channels {' '.join(kinds)[:60]!r}")
                joints[open_joints[-1]].channels[:] = list(enumerate(kinds, width))
                width += len(kinds)
            elif word == "}":
                open_joints.pop()
            else:
                raise ValueError(f"unexpected {word[:40]!r}")
    except (ValueError, IndexError, StopIteration) as error:
        reason = error if isinstance(error, ValueError) else "it breaks off"
        raise InputError(
            f"{path}: the hierarchy cannot be read: {reason}; export or copy it again",
            "SCHEMA_BROKEN",
        ) from error
    if open_joints or not width:
        raise InputError(
            f"{path}: the hierarchy has an open joint or no channels; "
            "expected a closed ROOT with CHANNELS",
            "SCHEMA_BROKEN",
        )
    return joints, width


def _motion(
    path: Path, text: str, section: str, width: int
) -> tuple[FloatArray, float, list[Finding]]:
    """Return the channels (F, width), the frame time [s] (0 = none) and missing frames."""
    header = _HEADER.match(section)
    if header is None:
        raise InputError(
            f"{path}: 'Frames:' and 'Frame Time:' are missing below MOTION; "
            "expected both in this order; export or copy it again",
            "SCHEMA_BROKEN",
        )
    words = section[header.end() :].split()
    try:
        numbers = np.fromiter(map(float, words), np.float64, len(words))
    except ValueError as error:
        raise InputError(
            f"{path}: the motion holds something else than numbers: {error}; "
            "export or copy it again",
            "ROW_WRONG",
        ) from error
    count, announced = len(words) // width, int(header[1])
    _check_rows(path, section[header.end() :], width, announced)
    rest = len(words) % width
    if words:
        last = text.rstrip().count("\n") + 1, words[-(rest or width) :]
        refuse_cut_end(path, text, last, width, count < announced)
    motion = numbers[: count * width].reshape(count, width)
    motion[~np.isfinite(motion)] = np.nan
    findings = compare_frames(path, announced, count)
    if rest and count >= announced:
        message = "a part of a frame after {frame_count} whole ones is not read"
        findings.append(finding("FRAMES_UNREAD", str(path), message, count))
    return motion, positive(header[2]), findings


def _check_rows(path: Path, text: str, width: int, announced: int) -> None:
    """Refuse rows of another number of channels: as a stream of numbers they give frames, too."""
    rows = [len(line.split()) for line in text.splitlines() if line.strip()]
    numbers = rows[0] if rows else width
    if len(rows) < 2 or any(n != numbers for n in rows) or numbers == width:
        return
    wrapped = max(numbers, width) % min(numbers, width) == 0 and len(rows) != announced
    if not wrapped:
        raise InputError(
            f"{path}: each row of the motion has {numbers} numbers, the hierarchy {width} "
            "channels; expected as many of both: export it again",
            "COLUMNS_WRONG",
        )


def _forward_kinematics(joints: list[_Joint], motion: FloatArray) -> FloatArray:
    """Return the world position of every joint: (F, joints, 3)."""
    count = len(motion)
    positions = np.empty((count, len(joints), 3))
    turns: list[FloatArray] = []
    for index, joint in enumerate(joints):
        place = np.tile(np.array(joint.offset), (count, 1))
        turn = np.broadcast_to(np.eye(3), (count, 3, 3))
        for column, kind in joint.channels:
            if kind.endswith("position"):
                place[:, _AXES[kind[0]]] = motion[:, column]
            else:
                turn = turn @ _turns(_AXES[kind[0]], np.radians(motion[:, column]))
        if joint.parent >= 0:
            above = turns[joint.parent]
            place = positions[:, joint.parent] + np.einsum("fij,fj->fi", above, place)
            turn = above @ turn
        positions[:, index] = place
        turns.append(turn)
    return positions


def _turns(axis: int, angles: FloatArray) -> FloatArray:
    """Return right-handed rotations about a coordinate axis: (F,) [rad] -> (F, 3, 3)."""
    one, two = (axis + 1) % 3, (axis + 2) % 3
    turns = np.zeros((len(angles), 3, 3))
    turns[:, axis, axis] = 1.0
    turns[:, one, one] = turns[:, two, two] = np.cos(angles)
    turns[:, two, one] = np.sin(angles)
    turns[:, one, two] = -turns[:, two, one]
    return turns
