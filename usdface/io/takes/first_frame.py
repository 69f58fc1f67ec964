"""The number of a take's first frame in its recording."""

from pathlib import Path

from usdface.findings import Finding, finding

__all__ = ["frames_before"]

_MOST_FRAMES = 1 << 31  # a larger number is no frame's


def frames_before(path: Path, number: float, start: int) -> tuple[int, list[Finding]]:
    """Return how many frames of the recording are before the first one of the file.

    Parameters
    ----------
    path : Path
    number : float
        Of the first frame in the file.
    start : int
        Where the format counts from: 0 or 1.

    Returns
    -------
    int
    list of Finding
        FRAMES_RENUMBERED unless it is 0.
    """
    if not start < number < _MOST_FRAMES:
        return 0, []
    message = "time 0 is frame {frame_number} of the recording"
    return int(number) - start, [finding("FRAMES_RENUMBERED", str(path), message, int(number))]
