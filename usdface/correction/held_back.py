"""Findings of emotions that are detected but not raised: a region does not match their pose."""

from collections.abc import Mapping

import numpy as np

from usdface.arrays import BoolArray
from usdface.correction.take_blending import MissingRegions, Outputs
from usdface.expression_system import ExpressionSystem
from usdface.face.mirror import Side
from usdface.findings import Finding, finding

__all__ = ["held_back_findings"]


def held_back_findings(
    system: ExpressionSystem, outputs: Outputs, missing: Mapping[Side, MissingRegions]
) -> list[Finding]:
    """Report each emotion that a region holds back where its pose would be raised in full.

    Judged by the whole face; an emotion that one half performs and is raised on is not held back.

    Parameters
    ----------
    system : ExpressionSystem
    outputs : mapping of "both", "left", "right" to (F, E) float64
    missing : mapping of "both", "left", "right" to mapping of "brows", "mouth" to (F, E) bool
        Frames in which a region does not match the pose (`usdface.correction.evidence`).
    """
    message = (
        "detected by up to {output:.2f} in {frame_count} frames ({first_frame} to {last_frame}) "
        "and not raised there: the weights of the {region} do not match its pose"
    )
    findings = []
    whole, held = outputs["both"], ~_raised_on_a_half(system, outputs, missing)
    for column, emotion in enumerate(system.emotions):
        strong = held[:, column] & (whole[:, column] >= system.response[1])
        for region, absent in missing["both"].items():
            frames = np.flatnonzero(strong & absent[:, column])
            if len(frames):
                most = whole[frames, column].max()
                values = (most, len(frames), frames[0], frames[-1], region)
                findings.append(finding("EXPRESSION_HELD_BACK", emotion, message, *values))
    return findings


def _raised_on_a_half(
    system: ExpressionSystem, outputs: Outputs, missing: Mapping[Side, MissingRegions]
) -> BoolArray:
    """Return the frames (F, E) in which a half of the face has an emotion, and all its regions."""
    raised = np.zeros(outputs["both"].shape, dtype=bool)
    for side in outputs.keys() - {"both"}:
        absent = [*missing[side].values()]
        raised |= (outputs[side] > system.response[0]) & ~np.any(absent, axis=0)
    return raised
