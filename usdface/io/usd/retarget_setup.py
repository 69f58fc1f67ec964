"""The setup of a face as a USD prim (`docs/architecture.md`)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, Vt

from usdface.errors import InputError, errors_at
from usdface.io.usd.attributes import author, strings_of, value_of, value_or
from usdface.io.usd.face_layout import EXAGGERATION
from usdface.io.usd.performer_face import author_performer_face, read_performer_face
from usdface.io.usd.unsure_places import read_unsure, write_unsure
from usdface.options import CleanOptions, ClosureOptions, MapOptions, SolveOptions, solve_settings
from usdface.schemas import tokens
from usdface.setup.binding import Binding
from usdface.setup.binding_origin import BindingOrigin
from usdface.setup.calibration import Calibration
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["check_neutral", "read_setup", "write_setup"]

_NAMES = Sdf.ValueTypeNames
_ORIGIN = "usdface:madeWith"  # of the custom data of bound vertices
_MAP = {
    tokens.MAP_KERNEL: ("kernel", _NAMES.Token),
    tokens.MAP_FORM: ("form", _NAMES.Token),
    tokens.MAP_CHOICE: ("choice", _NAMES.Token),
    tokens.MAP_RADIUS: ("radius", _NAMES.Double),
    tokens.MAP_SMOOTHING: ("smoothing", _NAMES.Double),
}
_SOLVE = {
    f"{tokens.SOLVE_PREFIX}{name}": (
        name,
        _NAMES.Token if setting.choices else _NAMES.Double,
    )
    for name, setting in solve_settings().items()
}
_CLEAN = {
    tokens.CLEAN_BLINKS: ("blinks", _NAMES.Bool),
    tokens.CLEAN_SWAPS: ("swaps", _NAMES.Bool),
    tokens.CLEAN_SPIKES: ("spikes", _NAMES.Bool),
    tokens.CLEAN_GAPS: ("gaps", _NAMES.Bool),
}
_CLOSURE = {
    tokens.CLOSURE_LIDS: ("lids", _NAMES.Bool),
    tokens.CLOSURE_LIPS: ("lips", _NAMES.Bool),
}


def write_setup(
    stage: Usd.Stage, path: str, setup: RetargetSetup, targets: dict[str, list[str]]
) -> None:
    """Define a `UsdFaceRetarget` prim; `targets` gives the prim paths of its relationships."""
    prim = stage.DefinePrim(path, tokens.RETARGET)
    for relationship, paths in targets.items():
        prim.CreateRelationship(relationship, custom=False).SetTargets(paths)
    author(prim, tokens.BIND_MARKERS, _NAMES.TokenArray, Vt.TokenArray(setup.binding.markers))
    author(prim, tokens.BIND_POINTS, _NAMES.IntArray, Vt.IntArray(setup.binding.points.tolist()))
    if setup.origin is not None:
        _author_origin(prim, setup.origin)
    if setup.binding.confidence is not None:
        sure = Vt.FloatArray(setup.binding.confidence.tolist())
        author(prim, tokens.BIND_CONFIDENCE, _NAMES.FloatArray, sure)
    write_unsure(prim, setup.unsure)
    author(prim, tokens.HEAD_MODE, _NAMES.Token, setup.head)
    author(prim, tokens.HEAD_MARKERS, _NAMES.TokenArray, Vt.TokenArray(setup.head_markers))
    author(prim, tokens.HEAD_APPLY, _NAMES.Bool, setup.move_head)
    author(prim, tokens.HEAD_JOINT, _NAMES.Token, setup.head_joint)
    if setup.eye_joints:
        author(prim, tokens.EYE_JOINTS, _NAMES.TokenArray, Vt.TokenArray(setup.eye_joints))
    if setup.eye_turn != 1.0:
        author(prim, tokens.EYE_TURN, _NAMES.Double, setup.eye_turn)
    author(prim, tokens.NOSE_TIP, _NAMES.Token, setup.nose_tip)
    author(prim, tokens.ROLES_NAMES, _NAMES.TokenArray, Vt.TokenArray(tuple(setup.roles)))
    author(
        prim, tokens.ROLES_MARKERS, _NAMES.TokenArray, Vt.TokenArray(tuple(setup.roles.values()))
    )
    mode = "rig" if setup.neutral is None else "frames"
    author(prim, tokens.NEUTRAL_MODE, _NAMES.Token, mode)
    author(prim, tokens.NEUTRAL_RANGE, _NAMES.Int2, Gf.Vec2i(*(setup.neutral or (0, 0))))
    if setup.neutral_removed:
        author(prim, tokens.NEUTRAL_REMOVED, _NAMES.Bool, True)
    if setup.neutral_weights:
        shapes, weights = zip(*setup.neutral_weights.items(), strict=True)
        author(prim, tokens.NEUTRAL_SHAPES, _NAMES.TokenArray, Vt.TokenArray(shapes))
        author(prim, tokens.NEUTRAL_WEIGHTS, _NAMES.FloatArray, Vt.FloatArray(weights))
    if setup.curves:
        _author_curves(prim, setup.curves)
    if setup.peaks:
        author(prim, tokens.PEAKS, _NAMES.IntArray, Vt.IntArray(setup.peaks))
    for table, options in (
        (_MAP, setup.map),
        (_SOLVE, setup.solve),
        (_CLEAN, setup.clean),
        (_CLOSURE, setup.closure),
    ):
        for name, (field, kind) in table.items():
            author(prim, name, kind, getattr(options, field))
    for part, factor in setup.exaggeration.items():
        prim.CreateAttribute(EXAGGERATION[part], _NAMES.Float, False).Set(factor)
    if setup.calibration is not None:
        _author_calibration(prim, setup.calibration)


def _author_curves(prim: Usd.Prim, curves: Mapping[str, Mapping[str, float]]) -> None:
    rows = [
        (curve, shape, factor)
        for curve, shapes in curves.items()
        for shape, factor in (shapes or {"": 0.0}).items()
    ]
    names, shapes, factors = zip(*rows, strict=True)
    author(prim, tokens.CURVES_NAMES, _NAMES.TokenArray, Vt.TokenArray(names))
    author(prim, tokens.CURVES_SHAPES, _NAMES.TokenArray, Vt.TokenArray(shapes))
    author(prim, tokens.CURVES_FACTORS, _NAMES.FloatArray, Vt.FloatArray(factors))


def _read_curves(prim: Usd.Prim) -> dict[str, dict[str, float]]:
    names = tuple(value_of(prim, tokens.CURVES_NAMES, Vt.TokenArray) or ())
    shapes = tuple(value_of(prim, tokens.CURVES_SHAPES, Vt.TokenArray) or ())
    factors = np.array(value_of(prim, tokens.CURVES_FACTORS, Vt.FloatArray) or (), np.float64)
    if not len(names) == len(shapes) == len(factors):
        raise InputError(
            f"{tokens.CURVES_NAMES} has {len(names)} entries, {tokens.CURVES_SHAPES} {len(shapes)} "
            f"and {tokens.CURVES_FACTORS} {len(factors)}; expected as many",
            "SCHEMA_BROKEN",
        )
    curves: dict[str, dict[str, float]] = {str(name): {} for name in names}
    for name, shape, factor in zip(names, shapes, factors.round(6).tolist(), strict=True):
        if shape in curves[name]:
            raise InputError(
                f"{tokens.CURVES_NAMES} has {name!r} with the shape {shape!r} twice; expected once",
                "NAME_REPEATED",
            )
        if factor and not shape:
            raise InputError(
                f"{tokens.CURVES_SHAPES} has no shape for {name!r}, whose factor is {factor:g}; "
                "expected one, or a factor of 0",
                "SCHEMA_BROKEN",
            )
        if shape:
            curves[name][str(shape)] = factor
    return curves


def _author_calibration(prim: Usd.Prim, calibration: Calibration) -> None:
    gains, offsets = calibration.gains.tolist(), calibration.offsets.tolist()
    names = Vt.TokenArray(calibration.shapes)
    author(prim, tokens.CALIBRATION_SHAPES, _NAMES.TokenArray, names)
    author(prim, tokens.CALIBRATION_GAINS, _NAMES.FloatArray, Vt.FloatArray(gains))
    author(prim, tokens.CALIBRATION_OFFSETS, _NAMES.FloatArray, Vt.FloatArray(offsets))
    if calibration.face is not None:
        author_performer_face(prim, calibration.face)


def _read_calibration(prim: Usd.Prim) -> Calibration | None:
    shapes = strings_of(prim, tokens.CALIBRATION_SHAPES)
    gains = np.array(value_or(prim, tokens.CALIBRATION_GAINS, ()), dtype=np.float64)
    offsets = np.array(value_or(prim, tokens.CALIBRATION_OFFSETS, ()), dtype=np.float64)
    face = read_performer_face(prim)
    if not (shapes or gains.size or offsets.size or face):
        return None
    return Calibration(shapes, gains, offsets if offsets.size else np.zeros(len(shapes)), face)


def read_setup(prim: Usd.Prim) -> RetargetSetup:
    """Read a `UsdFaceRetarget` prim; attributes that are not there have their defaults.

    Raises
    ------
    InputError
        If an attribute's value cannot be used; the message names prim and attribute.
    """
    mesh = prim.GetRelationship(tokens.BIND_MESH).GetTargets()
    markers = strings_of(prim, tokens.BIND_MARKERS)
    roles, playing = strings_of(prim, tokens.ROLES_NAMES), strings_of(prim, tokens.ROLES_MARKERS)
    if len(roles) != len(playing):
        raise InputError(
            f"{prim.GetPath()}: {tokens.ROLES_NAMES} has {len(roles)} entries, "
            f"{tokens.ROLES_MARKERS} has {len(playing)}; expected as many",
            "SCHEMA_BROKEN",
        )
    shown = strings_of(prim, tokens.NEUTRAL_SHAPES)
    weights = np.array(value_or(prim, tokens.NEUTRAL_WEIGHTS, ()), dtype=np.float64).round(6)
    if len(shown) != len(weights):
        raise InputError(
            f"{prim.GetPath()}: {tokens.NEUTRAL_SHAPES} has {len(shown)} entries, "
            f"{tokens.NEUTRAL_WEIGHTS} has {len(weights)}; expected as many",
            "SCHEMA_BROKEN",
        )
    start, end = value_or(prim, tokens.NEUTRAL_RANGE, (0, 0))
    points = np.array(value_or(prim, tokens.BIND_POINTS, ()), dtype=np.int64)
    sure = np.array(value_or(prim, tokens.BIND_CONFIDENCE, ()), dtype=np.float64)
    head = _choice(prim, tokens.HEAD_MODE, ("solve", "markers", "stabilised"))
    neutral = _choice(prim, tokens.NEUTRAL_MODE, ("frames", "rig"))
    with errors_at(f"prim <{prim.GetPath()}>"):
        binding = Binding(
            markers, points, str(mesh[0]) if mesh else "", sure if sure.size else None
        )
        return RetargetSetup(
            binding,
            head=head,
            head_markers=strings_of(prim, tokens.HEAD_MARKERS),
            move_head=_switch(prim, tokens.HEAD_APPLY, True),
            head_joint=str(value_or(prim, tokens.HEAD_JOINT, "")),
            eye_joints=strings_of(prim, tokens.EYE_JOINTS),
            eye_turn=float(value_or(prim, tokens.EYE_TURN, 1.0)),
            neutral=None if neutral == "rig" else (int(start), int(end)),
            neutral_removed=_switch(prim, tokens.NEUTRAL_REMOVED, False),
            neutral_weights=dict(zip(shown, weights.tolist(), strict=True)),
            curves=_read_curves(prim),
            peaks=tuple(int(frame) for frame in value_or(prim, tokens.PEAKS, ())),
            nose_tip=str(value_or(prim, tokens.NOSE_TIP, "")),
            roles=dict(zip(roles, playing, strict=True)),
            map=MapOptions(**_fields(prim, _MAP)),
            solve=SolveOptions(**_fields(prim, _SOLVE)),
            clean=CleanOptions(**_fields(prim, _CLEAN)),
            closure=ClosureOptions(**_fields(prim, _CLOSURE)),
            calibration=_read_calibration(prim),
            unsure=read_unsure(prim, binding),
            origin=_read_origin(prim),
        )


def check_neutral(
    prim: Usd.Prim, setup: RetargetSetup, take: MarkerTake | WeightsTake, count: int
) -> None:
    """Refuse neutral frames that a marker take of `count` frames does not have.

    Raises
    ------
    InputError
        Naming prim and attribute.
    """
    if setup.neutral is None or not isinstance(take, MarkerTake):
        return
    first, last = setup.neutral
    if first > last:
        raise InputError(
            f"prim <{prim.GetPath()}>: {tokens.NEUTRAL_RANGE} is ({first}, {last}), which is "
            "reversed; expected first and last frame",
            "SETTING_WRONG",
        )
    if not 0 <= first <= last < count:
        raise InputError(
            f"prim <{prim.GetPath()}>: {tokens.NEUTRAL_RANGE} is ({first}, {last}), which is not "
            f"within the frames of the take {take.source}: 0 to {count - 1}",
            "FRAMES_OUTSIDE",
        )


def _author_origin(prim: Usd.Prim, origin: BindingOrigin) -> None:
    """Keep the mesh of a binding beside its vertices; the take is named by the shot."""
    mesh = {"points": origin.points, "faces": origin.faces, "topology": origin.topology}
    prim.GetAttribute(tokens.BIND_POINTS).SetCustomDataByKey(_ORIGIN, mesh)


def _read_origin(prim: Usd.Prim) -> BindingOrigin | None:
    attribute = prim.GetAttribute(tokens.BIND_POINTS)
    kept = attribute.GetCustomDataByKey(_ORIGIN) if attribute else None
    if not isinstance(kept, dict):
        return None
    points, faces, topology = (kept.get(name) for name in ("points", "faces", "topology"))
    good = isinstance(points, int) and isinstance(faces, int) and isinstance(topology, str)
    return BindingOrigin(points, faces, topology) if good else None  # type: ignore[arg-type]


def _choice(prim: Usd.Prim, name: str, choices: Sequence[str]) -> Any:
    value = str(value_or(prim, name, choices[0]))
    if value not in choices:
        raise InputError(
            f"prim <{prim.GetPath()}>: {name} is {value!r}; expected {', '.join(choices)}",
            "SETTING_WRONG",
        )
    return value


def _switch(prim: Usd.Prim, name: str, default: bool | None) -> Any:
    """Return a boolean; text that says "false" would count as true."""
    value = value_or(prim, name, default)
    if value is not None and not isinstance(value, bool):
        raise InputError(f"{name} is {value!r}; expected true or false", "SETTING_WRONG")
    return value


def _fields(prim: Usd.Prim, table: dict[str, tuple[str, Any]]) -> dict[str, Any]:
    """Read the settings that are authored, under the names of their options."""
    authored = {
        field: (_switch if kind == _NAMES.Bool else value_or)(prim, name, None)
        for name, (field, kind) in table.items()
    }
    return {field: value for field, value in authored.items() if value is not None}
