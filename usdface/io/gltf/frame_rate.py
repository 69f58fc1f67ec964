"""The frame rate of keys, which glTF does not name."""

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["frame_rate"]

_SLOWEST, _FASTEST = 12.0, 240.0  # frames per second that animation and capture are made at
_COMMON = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 90.0, 120.0)
_OFF = 0.02  # of a frame: times are rounded to float32, and by exporters


def frame_rate(keys: FloatArray) -> float:
    """Return the frame rate [Hz] whose frames all keys (K,) [s] fall on, 0 where there is none.

    The rate of their own steps where that is one that animation is made at, else a common one.
    """
    if len(keys) < 2:
        return 0.0
    steps = np.diff(keys)
    frames = np.round(steps / np.median(steps))
    own = float(np.round(frames.sum() / (keys[-1] - keys[0]), 3))
    off = np.abs((keys - keys[0]) * own - np.cumsum([0, *frames])).max()
    if _SLOWEST <= own <= _FASTEST and off < _OFF:
        return own
    return next((rate for rate in _COMMON if _on_frames(keys * rate)), 0.0)


def _on_frames(frames: FloatArray) -> bool:
    whole = np.round(frames)
    return bool(np.abs(frames - whole).max() < _OFF and (np.diff(whole) >= 1).all())
