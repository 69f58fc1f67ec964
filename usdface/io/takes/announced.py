"""Frames that a file holds, compared with the number that its header announces."""

from pathlib import Path

from usdface.findings import Finding, finding

__all__ = ["compare_frames"]


def compare_frames(path: Path, announced: float, held: int) -> list[Finding]:
    """Return the differences; all `held` frames are read. 0 announced = the header does not say."""
    if not announced or announced == held:
        return []
    code, end = "FRAMES_MISSING", ""
    if announced < held:
        code, end = "FRAMES_UNANNOUNCED", "; all are read"
    message = "the header announces {expected_count:g} frames, the file holds {frame_count}"
    return [finding(code, str(path), message + end, announced, held)]
