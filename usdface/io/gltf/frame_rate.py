"""The frame rate of keys, which glTF does not name."""

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["chosen_rate", "frame_rate"]

_SLOWEST, _FASTEST = 12.0, 240.0  # frames per second that animation and capture are made at
_COMMON = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 90.0, 120.0)
_NAMED = np.array([*_COMMON, 23.976, 29.97, 59.94, 119.88])
_OFF = 0.02  # of a frame: times are rounded to float32, and by exporters
_DIGITS = 3  # of a rate
_NEAR = 5e-4  # of a rate: half of the way from 30 to 29.97 Hz; a camera's clock is off by less


def frame_rate(keys: FloatArray) -> float:
    """Return the frame rate [Hz] whose frames all keys (K,) [s] fall on, 0 where there is none.

    The rate of their own steps where that is one that animation is made at, else a common one. A
    common one, too, where float32 does not tell it from that of the steps.
    """
    if len(keys) < 2:
        return 0.0
    steps = np.diff(keys)
    frames = np.round(steps / np.median(steps))
    own = _without_rounding(float(frames.sum() / (keys[-1] - keys[0])), keys)
    off = np.abs((keys - keys[0]) * own - np.cumsum([0, *frames])).max()
    if _SLOWEST <= own <= _FASTEST and off < _OFF:
        return own
    return next((rate for rate in _COMMON if _on_frames(keys * rate)), 0.0)


def chosen_rate(shown: float, stated: float) -> float:
    """Return the frame rate [Hz] of a clip: the stated one, unless its keys are of another.

    Parameters
    ----------
    shown : float [Hz]
        That of the keys, by `frame_rate`. A camera's clock that is a little off shows 30.004.
    stated : float [Hz]
        The scene's, kept in extras; 0 = none.
    """
    fits = abs(stated - shown) < _NEAR * shown if shown else stated in _NAMED
    return stated if fits else shown


def _without_rounding(rate: float, keys: FloatArray) -> float:
    """Return the rate, or the common one that rounding the keys to float32 may have made it of."""
    nearest = float(_NAMED[np.abs(_NAMED - rate).argmin()])
    rounding = float(np.spacing(np.float32(np.abs(keys).max()))) / float(keys[-1] - keys[0])
    return nearest if abs(nearest - rate) <= rounding * rate else round(rate, _DIGITS)


def _on_frames(frames: FloatArray) -> bool:
    whole = np.round(frames)
    return bool(np.abs(frames - whole).max() < _OFF and (np.diff(whole) >= 1).all())
