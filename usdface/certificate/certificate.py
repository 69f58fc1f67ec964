"""The certificate of a conversion: values, one line, and findings."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from usdface.findings import Finding, finding

__all__ = ["FLOAT32", "Certificate"]

_SUMMARY = (
    "frames_compared",
    "vertex_error_max_mm",
    "normal_error_max_degrees",
    "weight_error_max",
    "time_drift_s",
)

FLOAT32 = 2.0**-23  # relative spacing of float32 numbers (IEEE 754)
_EXACT = 1e-5  # of the bounding diagonal, a weight, a second: 84 float32 roundings
_SMALLEST = 1e-3  # m, of a diagonal: a mesh that is scaled to nothing at rest has none
_STRAIGHT = 0.5  # degrees: turns a shade by sin(0.5°) at most, 2 of 255 steps


@dataclass(frozen=True, slots=True)
class Certificate:
    """Differences between the source and the result of a conversion.

    Attributes
    ----------
    frames, of_frames : int
        Number of compared frames, and of all.
    diagonal : float [m]
        Of the source's bounding box at rest.
    vertex_largest, vertex_mean : float [m]
    vertex_worst : str
        Mesh of the largest vertex error.
    normal_largest, normal_mean : float [degrees] or None
        None where the source has no deformed vertex normals to compare with.
    weights : dict of str to float
        Largest error of each channel, ``mesh/shape``.
    weight_excess : float
        Largest of these errors beyond that of times stored as float32.
    vertex_excess : float [m]
    normal_excess : float [degrees]
        Largest errors beyond the rounding of whole numbers.
    vertex_rounding : float [m]
    normal_rounding : float [degrees]
        Most that this rounding can do in a compared frame; 0 where the result has floats.
    time_drift : float [s]
    duration : float [s]
        The last moment.
    names : dict of str to str
        Names of meshes and channels in the source, and in the result if they differ.
    missing : tuple of str
        Meshes, channels and clips that only one side has.
    decoded : bool
        Compressed data were decoded for the evaluation by the decoder of the conversion.
    clips : mapping of str to Certificate
        Each clip for itself, where there are several.
    """

    frames: int
    of_frames: int
    diagonal: float
    vertex_largest: float
    vertex_mean: float
    vertex_worst: str
    normal_largest: float | None
    normal_mean: float | None
    weights: dict[str, float]
    weight_excess: float
    vertex_excess: float
    normal_excess: float
    vertex_rounding: float
    normal_rounding: float
    time_drift: float
    duration: float
    names: dict[str, str]
    missing: tuple[str, ...]
    clips: Mapping[str, "Certificate"] = field(default_factory=dict)
    decoded: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Return the certificate as plain values, each name with its unit."""
        clips = {name: clip.as_dict() for name, clip in self.clips.items()}
        return {
            "frames_compared": self.frames,
            "frames": self.of_frames,
            "bounding_diagonal_mm": 1000 * self.diagonal,
            "vertex_error_max_mm": 1000 * self.vertex_largest,
            "vertex_error_mean_mm": 1000 * self.vertex_mean,
            "vertex_error_max_mesh": self.vertex_worst,
            "vertex_rounding_max_mm": 1000 * self.vertex_rounding,
            "normal_error_max_degrees": self.normal_largest,
            "normal_error_mean_degrees": self.normal_mean,
            "normal_rounding_max_degrees": self.normal_rounding,
            "weight_error_max": max(self.weights.values(), default=0.0),
            "weight_errors": self.weights,
            "time_drift_s": self.time_drift,
            "names": self.names,
            "missing": list(self.missing),
            "decoded_by_reader": self.decoded,
        } | ({"clips": clips} if clips else {})

    @property
    def summary(self) -> dict[str, float | int | None]:
        """The largest differences, of the keys of `as_dict`."""
        whole = self.as_dict()
        return {key: whole[key] for key in _SUMMARY}

    def findings(self, where: str) -> list[Finding]:
        """Return a warning for differences beyond the rounding of float32 and of whole numbers."""
        limit = _EXACT * max(self.diagonal, _SMALLEST)
        weight = max(self.weights.values(), default=0.0)
        turned = self.normal_largest or 0.0
        drifts = self.time_drift > max(_EXACT, FLOAT32 * self.duration)
        losses: list[tuple[bool, str, object]] = [
            (
                self.vertex_excess > limit,
                "vertices by {vertex_mm:.3g} mm",
                self.vertex_largest * 1e3,
            ),
            (self.normal_excess > _STRAIGHT, "normals by {normal_degrees:.3g} degrees", turned),
            (self.weight_excess > _EXACT, "weights by {weight:.3g}", weight),
            (drifts, "times by {time_s:.3g} s", self.time_drift),
            (bool(self.missing), "only on one side: {missing}", self.missing),
        ]
        errors = [(text, value) for lost, text, value in losses if lost]
        if not errors:
            return []
        message = "it differs from its source: " + "; ".join(text for text, _ in errors)
        return [finding("CONVERSION_INEXACT", where, message, *(value for _, value in errors))]
