"""Hooks: functions of other packages between the steps of a job.

Each gets immutable arrays and returns a new value, or None to leave it as it is. Hooks are values
that are passed to a job; `usdface.io.plugins` finds those that are installed (docs/hooks.md).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar, get_args

import numpy as np

from usdface.arrays import FloatArray
from usdface.clips import Clip
from usdface.errors import InputError, PluginError, UsdFaceError
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.plain_text import listed
from usdface.rigs import Rig
from usdface.takes import MarkerTake, WeightsTake, check_range, visible

__all__ = ["Hook", "HookPoint", "run_hooks"]

HookPoint = Literal["take_read", "weights_solved", "weights_corrected", "before_export"]
_MISTAKES = (Exception, SystemExit)  # of code that is not ours
_NAMED = 4  # markers and blend shapes that a message lists
_SLACK = 1e-9  # of a weight beyond 0 or 1 that is rounding

Value = TypeVar("Value")


@dataclass(frozen=True, slots=True)
class Hook:
    """A function that a job calls at a point.

    Attributes
    ----------
    point : {"take_read", "weights_solved", "weights_corrected", "before_export"}
        ``take_read(take, shot)`` gets the take as recorded, before the clean-up.
        ``weights_solved(weights, shot)`` gets the weights of the bound mesh's blend shapes, before
        the correction; ``weights_corrected(weights, shot)`` those of the whole character after it.
        ``before_export(rig, clips)`` returns both.
    name : str
        ``"distribution:entry point"``.
    function : callable
        Returns a value of the type of its first argument, or None: unchanged.
    origin : str
        Distribution, version and entry point, for messages.

    Raises
    ------
    InputError
        If there is no such point.

    Examples
    --------
    >>> def softer(weights: usdface.WeightsTake, shot: usdface.Shot) -> usdface.WeightsTake:
    ...     return replace(weights, weights=0.9 * weights.weights)
    >>> usdface.Hook("weights_solved", "acme:weights_solved", softer).origin
    'acme:weights_solved'
    """

    point: HookPoint
    name: str
    function: Callable[..., Any]
    origin: str = ""

    def __post_init__(self) -> None:
        if self.point not in get_args(HookPoint):
            raise InputError(
                f"hook {self.name!r}: there is no point {self.point!r}; expected one of "
                f"{', '.join(get_args(HookPoint))}",
                "SETTING_WRONG",
            )
        if not self.origin:
            object.__setattr__(self, "origin", self.name)

    def call(self, value: Value, *arguments: Any) -> Value:
        """Return the value that the function returns, checked; `value` if it returns None.

        Raises
        ------
        PluginError
            If the function raises, or returns another kind of value.
        """
        try:
            given = self.function(*_unpacked(value), *arguments)
            if given is None:
                return value
            checked: Value = _CHECKS[self.point](value, given)
        except _MISTAKES as error:
            kind = "" if isinstance(error, UsdFaceError) else f"{type(error).__name__}: "
            message = " ".join(f"{kind}{error}".split())
            raise PluginError(
                f"the hook {self.point} of {self.origin} failed and the run is stopped: {message}; "
                f"--skip-hook {self.name} leaves it out",
                "HOOK_FAILED",
            ) from error
        return checked


def run_hooks(
    hooks: Sequence[Hook], point: HookPoint, value: Value, *arguments: Any
) -> tuple[Value, list[Finding]]:
    """Return a value after the hooks of a point, in their order, and findings on their changes.

    Parameters
    ----------
    hooks : sequence of Hook
        Those of other points are left out.
    point : str
    value : MarkerTake, WeightsTake, or (Rig, tuple of Clip)
    *arguments
        Passed on to each.

    Returns
    -------
    value
    list of Finding
        HOOK_APPLIED for each that changed it.

    Raises
    ------
    PluginError
        If one fails; the message names its distribution.
    """
    found = []
    for hook in hooks:
        if hook.point == point:
            given = hook.call(value, *arguments)
            change = _CHANGES[point](value, given)
            if change:
                message = "{origin} changed {change}"
                found.append(
                    finding(
                        "HOOK_APPLIED",
                        hook.name,
                        message,
                        hook.origin,
                        Prose(change),
                        hook_point=point,
                    )
                )
            value = given
    return value, found


def _unpacked(value: Any) -> tuple[Any, ...]:
    return value if isinstance(value, tuple) else (value,)


def _checked_take(before: MarkerTake | WeightsTake, given: Any) -> MarkerTake | WeightsTake:
    if type(given) is not type(before):
        raise InputError(f"it returned {_kind(given)}; expected {_kind(before)}")
    if not np.array_equal(given.times, before.times):
        raise InputError("it returned a take with other times; expected those that it was given")
    check_range(given)
    checked: MarkerTake | WeightsTake = given
    return checked


def _checked_weights(before: WeightsTake, given: Any) -> WeightsTake:
    _checked_take(before, given)
    if set(given.names) != set(before.names):
        other = sorted(set(given.names) ^ set(before.names))
        raise InputError(
            f"it returned other blend shapes ({listed(other, _NAMED)}); expected those of the "
            "weights that it was given"
        )
    low, high = float(given.weights.min()), float(given.weights.max())
    bottom = min(0.0, float(before.weights.min())) - _SLACK
    top = max(1.0, float(before.weights.max())) + _SLACK
    if low < bottom or high > top:
        raise InputError(f"it returned weights from {low:.3g} to {high:.3g}; expected 0 to 1")
    checked: WeightsTake = given.reordered(before.names)
    return checked


def _checked_scene(before: tuple[Rig, tuple[Clip, ...]], given: Any) -> Any:
    if not (isinstance(given, tuple | list) and len(given) == 2):
        raise InputError(f"it returned {_kind(given)}; expected (rig, clips)")
    rig, clips = given[0], given[1]
    if not isinstance(rig, Rig):
        raise InputError(f"it returned {_kind(rig)} as the rig; expected Rig")
    if not (isinstance(clips, tuple | list) and all(isinstance(each, Clip) for each in clips)):
        raise InputError("it returned clips that are none; expected Clip objects")
    return rig, tuple(clips)


def _kind(value: object) -> str:
    return type(value).__name__


def _take_change(before: Any, after: Any) -> str:
    if isinstance(before, WeightsTake):
        return _weights_change(before, after)
    if before.names != after.names:
        gone, new = set(before.names) - set(after.names), set(after.names) - set(before.names)
        out, added = (listed(sorted(names), _NAMED) or "none" for names in (gone, new))
        return f"the markers: {out} left out, {added} added"
    moved = np.linalg.norm(after.positions - before.positions, axis=2)
    seen = visible(before.positions) != visible(after.positions)
    changed = seen | (np.nan_to_num(moved) > 0)
    if not changed.any():
        return ""
    unit, scale = ("px", 1.0) if before.dimension == 2 else ("mm", 1000.0)
    hidden = f", {seen.sum()} seen or occluded otherwise" if seen.any() else ""
    furthest = scale * float(np.nan_to_num(moved).max())
    return (
        f"{changed.sum()} of {changed.size} marker positions in {changed.any(axis=1).sum()} "
        f"frames, by {furthest:.3g} {unit} at most{hidden}"
    )


def _weights_change(before: WeightsTake, after: WeightsTake) -> str:
    changes = [_curves_change(before, after), _head_change(before.head, after.head)]
    return "; ".join(change for change in changes if change)


def _head_change(before: FloatArray | None, after: FloatArray | None) -> str:
    if before is None or after is None:
        return "" if before is after else f"the head {'left out' if after is None else 'added'}"
    turned = np.linalg.norm(after - before, axis=1)
    furthest = float(np.degrees(turned.max(initial=0.0)))
    frames = (turned > 0).sum()
    return f"the head in {frames} frames, by {furthest:.3g} degrees at most" if frames else ""


def _curves_change(before: WeightsTake, after: WeightsTake) -> str:
    if before.names != after.names:
        return f"{len(before.names)} curves to {len(after.names)}"
    change = np.abs(after.weights - before.weights)
    moved = change.max(axis=0) > 0
    if not moved.any():
        return ""
    most = before.names[int(change.max(axis=0).argmax())]
    return (
        f"{moved.sum()} of {moved.size} blend shapes in {(change.max(axis=1) > 0).sum()} frames, "
        f"{most} most, by {change.max():.3g}"
    )


def _scene_change(before: tuple[Rig, tuple[Clip, ...]], after: tuple[Rig, tuple[Clip, ...]]) -> str:
    parts = []
    if after[0] is not before[0]:
        parts.append("the rig")
    if len(after[1]) != len(before[1]):
        parts.append(f"the clips, {len(before[1])} to {len(after[1])}")
    elif any(a is not b for a, b in zip(before[1], after[1], strict=True)):
        parts.append("the clips")
    return " and ".join(parts)


_CHECKS: dict[HookPoint, Callable[..., Any]] = {
    "take_read": _checked_take,
    "weights_solved": _checked_weights,
    "weights_corrected": _checked_weights,
    "before_export": _checked_scene,
}
_CHANGES: dict[HookPoint, Callable[..., str]] = {
    "take_read": _take_change,
    "weights_solved": _weights_change,
    "weights_corrected": _weights_change,
    "before_export": _scene_change,
}
