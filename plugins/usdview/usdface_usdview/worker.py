"""The worker: a process that solves, beside usdview. Lines of JSON in, lines of JSON out.

``python -m usdface_usdview.worker``. It calls the public functions of usdface and holds the last
result, so that gains, explanations and colours take no new solve. A request is ``{"id", "job",
...}``; answers are ``{"id", "step"}``, then ``{"id", "result"}`` or ``{"id", "error"}``.
"""

import base64
import json
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TextIO

import numpy as np

import usdface

__all__ = ["main"]


@dataclass(frozen=True)
class _Held:
    """The last result, and the shot that it is of."""

    shot: str
    value: usdface.ShotResult
    solved: usdface.ShotResult


def process(held: _Held | None, request: dict[str, Any], announce: Callable[..., None]) -> Any:
    """Retarget a shot, or correct it again if only gains changed, and write its layers."""
    shot = request["shot"]
    again = held if held and held.shot == shot and request.get("again") else None
    options = usdface.ProcessOptions(trace=True, gains=request.get("gains") or {})
    result = usdface.process(
        shot,
        output=request["output"],
        overwrite=request.get("overwrite", False),
        options=options,
        solved=again.solved if again else None,
        on_progress=lambda step: announce(step.name, step.fraction),
    )
    value = result.value
    solution = value.solution
    answer: dict[str, Any] = {
        "written": [str(path) for path in result.written],
        "emotions": {name: _short(curve) for name, curve in value.emotions.items()},
        "residual_mm": _short(1000.0 * solution.residual) if solution else [],
        "gains": {each.name: each.gain for each in value.shot.expressions},
        "mesh": value.shot.mesh.path,
        "verdict": _verdict(result),
        "findings": [each.as_dict() | {"message": each.message} for each in result.findings],
        "summary": result.summary,
    }
    if not again:
        answer["frames"] = _worst_first(usdface.peak_frames(value))
    return _Held(shot, value, again.solved if again else value), answer


def explain(held: _Held | None, request: dict[str, Any], announce: Callable[..., None]) -> Any:
    """Explain a frame of the last result."""
    if held is None:
        raise usdface.InputError("there is no result yet; process the shot first")
    if held.value.trace is None:
        raise usdface.InputError("the shot has no expression layer to explain")
    return held, usdface.explain_result(held.value).frame(request["frame"])


def colours(held: _Held | None, request: dict[str, Any], announce: Callable[..., None]) -> Any:
    """Return the colours of the residual in a frame of the last result, as base64 of float32."""
    if held is None:
        raise usdface.InputError("there is no result yet; process the shot first")
    (found,) = usdface.residual_colours(held.value, (request["frame"],))
    packed = base64.b64encode(np.asarray(found, np.float32).tobytes()).decode("ascii")
    return held, {"mesh": held.value.shot.mesh.path, "colours": packed}


_JOBS = {"process": process, "explain": explain, "colours": colours}


def _worst_first(frames: dict[int, str]) -> list[list[Any]]:
    """Return frames with the reasons to look at them: residuals, corrections, then the others."""
    first = ("residual", "correction")

    def rank(frame: int) -> int:
        reasons = frames[frame].split(", ")
        return next((i for i, reason in enumerate(first) if reason in reasons), len(first))

    return [[frame, frames[frame]] for frame in sorted(frames, key=lambda f: (rank(f), f))]


def _verdict(result: usdface.Result) -> dict[str, Any] | None:
    if result.verdict is None:
        return None
    return {
        "level": result.verdict.level,
        "reasons": [
            {
                "message": reason.message,
                "remedy": reason.criterion.remedy,
                "frames": list(reason.measured.frames),
            }
            for reason in result.verdict.reasons
        ],
    }


def _short(curve: Any) -> list[float]:
    return [round(float(value), 4) for value in curve]


def main() -> None:
    """Answer requests until standard input ends."""
    # What libraries print is no answer
    answers: TextIO = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    held: _Held | None = None
    for line in sys.stdin:
        request = json.loads(line)

        def say(number: int = request["id"], **content: Any) -> None:
            answers.write(json.dumps({"id": number, **content}) + "\n")
            answers.flush()

        try:
            held, result = _JOBS[request["job"]](
                held, request, lambda name, fraction, say=say: say(step=[name, fraction])
            )
            say(result=result)
        except usdface.UsdFaceError as error:
            say(error=str(error), code=error.code)
        except Exception as error:  # the worker lives on, and usdview says what happened
            say(error=f"a mistake in usdface: {type(error).__name__}: {error}", code="")


if __name__ == "__main__":
    main()
