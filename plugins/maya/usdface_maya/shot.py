"""The work of the chaser, on any stage: setup and retarget, by the options of an export."""

from collections.abc import Mapping
from typing import Any

from pxr import Usd

import usdface

__all__ = ["OPTIONS", "SETUP", "apply"]

# Where the setup is authored, unless the option `scope` names another prim
SETUP = "/UsdFace"
# Options of the chaser: all are strings, as Maya gives them
OPTIONS = {
    "take": "the recorded take: C3D, TRC, CSV, BVH, Live Link Face or USD",
    "bind": "the binding, .json; without it places of the markers are proposed",
    "rig": "path of the SkelRoot, where the export has several",
    "neutral": "first and last neutral frame of the take: 0-29; or auto",
    "scope": f"prim that holds the setup; {SETUP} if left out",
    "gains": "emotions more or less: joy=0.5,anger=0",
    "exaggeration": "factors on the solve: 1.1,brows=1.4",
    "express": "0: no expression layer",
    "closure": "0: eyes and lips are not closed",
    "head": "0: the head stays still",
    "skip_hooks": "hooks that do not run: studio-hooks,other-hooks",
    "on_error": "stop: an error of usdface ends the export; else it is reported and the face stays",
}
_ONCE = "an export has its setup already, or the options name a take to make one with: take=FILE"


def apply(stage: Usd.Stage, options: Mapping[str, str]) -> usdface.Result:
    """Set a face up, if the stage has no setup, and retarget it; author on the edit target.

    Parameters
    ----------
    stage : Usd.Stage
    options : mapping of str to str
        As `OPTIONS` names them.

    Returns
    -------
    usdface.Result
        Of `usdface.apply`; findings of both steps.

    Raises
    ------
    usdface.UsdFaceError
        In one line; the stage is as it was.
    """
    for name in options:
        if name not in OPTIONS:
            raise usdface.InputError(
                f"there is no option {name!r} of the chaser; it has {', '.join(OPTIONS)}",
                "SETTING_WRONG",
            )
    process = usdface.ProcessOptions(
        express=_on(options, "express"),
        closure=_on(options, "closure"),
        head=_on(options, "head"),
        gains=_factors(options, "gains"),
        exaggeration=_factors(options, "exaggeration", "face"),
    )
    findings: tuple[usdface.Finding, ...] = ()
    scope = options.get("scope", SETUP)
    authored = not _has_setup(stage)
    if authored:
        findings = _set_up(stage, options, scope)
    try:
        result = usdface.apply(stage, options=process, skip_hooks=_words(options, "skip_hooks"))
    except usdface.UsdFaceError:
        if authored:
            stage.RemovePrim(scope)
        raise
    return usdface.Result(
        result.value,
        (),
        (*findings, *result.findings),
        result.summary,
        result.details,
        result.seconds,
        result.verdict,
    )


def _set_up(
    stage: Usd.Stage, options: Mapping[str, str], scope: str
) -> tuple[usdface.Finding, ...]:
    if not options.get("take"):
        raise usdface.InputError(f"nothing to retarget: {_ONCE}", "SHOT_INCOMPLETE")
    take, findings = usdface.read_take(options["take"])
    result = usdface.set_up(
        stage,
        take=take,
        rig=options.get("rig", ""),
        bind=options.get("bind") or None,
        binding=usdface.BindOptions(neutral=_neutral(options.get("neutral", ""))),
        scope=scope,
    )
    return (*findings, *result.findings)


def _has_setup(stage: Usd.Stage) -> bool:
    return any(prim.GetTypeName() == "UsdFaceRetarget" for prim in stage.Traverse())


def _on(options: Mapping[str, str], name: str) -> bool:
    value = options.get(name, "1").strip().lower()
    if value not in ("0", "1", "true", "false"):
        raise usdface.InputError(f"{name}={value}; expected 0 or 1", "SETTING_WRONG")
    return value in ("1", "true")


def _words(options: Mapping[str, str], name: str) -> list[str]:
    return [word.strip() for word in options.get(name, "").split(",") if word.strip()]


def _factors(options: Mapping[str, str], name: str, whole: str = "") -> dict[str, float]:
    factors = {}
    for word in _words(options, name):
        part, _, number = word.rpartition("=")
        key = part.strip() or whole
        try:
            if key in factors or (factors and not part):  # 1,2 is a decimal with a comma
                raise ValueError(word)
            factors[key] = float(number)
        except ValueError as error:
            expected = "joy=0.5,anger=0" if name == "gains" else "1.1,brows=1.4"
            raise usdface.InputError(
                f"{name}={options[name]}; expected factors: {expected}", "SETTING_WRONG"
            ) from error
    return factors


def _neutral(text: str) -> Any:
    if text in ("", "auto"):
        return text or None
    first, _, last = text.partition("-")
    try:
        return int(first), int(last or first)
    except ValueError as error:
        raise usdface.InputError(
            f"neutral={text}; expected the first and last frame index: 0-29, or auto",
            "SETTING_WRONG",
        ) from error
