"""The error that is left where parts of a performer's file are replaced by the truth."""

from dataclasses import replace
from pathlib import Path

import numpy as np

import usdface
from benchmarks.performers.solvers import make_shot, ours, processed
from benchmarks.performers.worlds import Performance
from benchmarks.solve.faces import Face
from usdface.arrays import FloatArray
from usdface.io.calibration_file import calibration_json, read_calibration_file
from usdface.options import PERFORMER_GAIN_SPREAD
from usdface.setup.calibration import Calibration

__all__ = ["errors_with_given_values"]

# Of a neutral that is known: so many neutral frames.
_MANY = 100_000


def errors_with_given_values(
    performance: Performance, face: Face, character: Path, strengths: FloatArray
) -> dict[str, FloatArray]:
    """Return errors (F, S) of a first take, with the file, and with more and more of it given."""
    assert performance.other is not None
    file = character.parent / "performer.json"
    usdface.calibrate(make_shot(performance.other, face, character), file)
    learned = read_calibration_file(file)
    assert learned.face is not None
    markers = [face.names.index(name) for name in learned.face.markers]
    shapes = [face.mesh.shape_names.index(name) for name in learned.face.shapes]
    own = performance.offsets / strengths[:, None, None]
    points = face.mesh.points
    neutral = replace(learned.face, rest=performance.neutral[markers], frames=_MANY)
    directions = replace(learned.face, displacements=own[np.ix_(shapes, markers)])
    shifts = points[performance.worn[markers]] - points[performance.bound[markers]]
    wholly = replace(neutral, displacements=directions.displacements, shifts=shifts)
    sized = strengths[[face.mesh.shape_names.index(name) for name in learned.shapes]]
    known = {
        "with the file": learned,
        "neutral given": replace(learned, face=neutral),
        "directions given": replace(learned, face=directions),
        "neutral, places, directions given": replace(learned, face=wholly),
        "strengths given": replace(learned, gains=sized),
        "all given": Calibration(learned.shapes, sized, np.zeros(len(sized)), wholly),
    }
    errors = {"first take": ours(performance, face, character) - performance.truth}
    for name, calibration in known.items():
        open_ = np.full(len(sized), PERFORMER_GAIN_SPREAD)
        file.write_text(calibration_json(calibration, open_, np.ones(len(sized))), "utf-8")
        shot = make_shot(performance, face, character, file)
        errors[name] = processed(shot, performance, face) - performance.truth
    return errors
