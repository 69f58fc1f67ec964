"""Findings of emotions that are detected and not raised, as the face does not show their poses."""

from collections.abc import Mapping

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.expression_system import ExpressionSystem
from usdface.face.regions import GainRegion
from usdface.findings import Finding, finding

__all__ = ["held_back_findings"]


def held_back_findings(
    system: ExpressionSystem, outputs: FloatArray, missing: Mapping[GainRegion, BoolArray]
) -> list[Finding]:
    """Report each emotion that a region holds back where its pose would be raised in full.

    Parameters
    ----------
    system : ExpressionSystem
    outputs : (F, E) float64
        Of the whole face.
    missing : mapping of "brows", "mouth" to (F, E) bool
        Frames in which a region does not show the pose (`usdface.correction.evidence`).
    """
    message = (
        "detected by up to {output:.2f} in {frame_count} frames ({first_frame} to {last_frame}) "
        "and not raised there: the weights of the {region} are not like its pose"
    )
    findings = []
    for column, emotion in enumerate(system.emotions):
        strong = outputs[:, column] >= system.response[1]
        for region, absent in missing.items():
            frames = np.flatnonzero(strong & absent[:, column])
            if len(frames):
                most = outputs[frames, column].max()
                values = (most, len(frames), frames[0], frames[-1], region)
                findings.append(finding("EXPRESSION_HELD_BACK", emotion, message, *values))
    return findings
