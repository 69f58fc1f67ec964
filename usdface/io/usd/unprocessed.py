"""Shots that were not processed: their take does not move the face yet."""

from pathlib import Path

from pxr import Usd

from usdface.findings import Finding, finding
from usdface.io.layer_paths import layer_paths
from usdface.io.usd.generation import stage_generations
from usdface.schemas import tokens

__all__ = ["report_unprocessed"]


def report_unprocessed(stage: Usd.Stage, path: Path) -> list[Finding]:
    """Return RESULT_ABSENT where a stage is a shot without a result.

    A face that rests looks like a failed solve; mostly the shot was named in place of its result.
    A result is known by its layers' generation, a flattened one by its verdict.
    """
    setups = [prim for prim in stage.Traverse() if prim.GetTypeName() == tokens.RETARGET]
    judged = any(prim.GetAttribute(tokens.VERDICT).Get() for prim in setups)
    if not setups or judged or stage_generations(stage):
        return []
    result = layer_paths(path).root.name if path.suffix != ".usdz" else ""
    message = "its take does not move the face: the shot was not processed"
    if not result:
        return [finding("RESULT_ABSENT", str(path), message)]
    beside = path.with_name(result).is_file()
    message += "; its result is {result}" if beside else "; `usdface process` makes {result}"
    return [finding("RESULT_ABSENT", str(path), message, result)]
