"""The data of a page's contact sheet: every n-th image of a take with its labelled dots."""

import base64
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.takes import MarkerTake

__all__ = ["face_box", "footage_data", "images_of_frames", "shown_frames"]

_SHOWN = 24  # images
_ROOM = 0.12  # around the dots, as a share of their extent


def shown_frames(take: MarkerTake) -> list[int]:
    """Return the indices of the frames that a page shows: evenly spread, the first and last too."""
    count = len(take.times)
    spread = np.linspace(0, count - 1, min(_SHOWN, count)).round()
    return sorted({int(frame) for frame in spread.tolist()})


def images_of_frames(take: MarkerTake) -> IntArray:
    """Return the index (F,) of the image of each frame in the footage.

    A take of images has a frame for each, whatever their times; tracks of another program may begin
    later than the footage, and leave frames out.
    """
    if take.diameters is not None:
        return np.arange(len(take.times))
    return np.round(take.times * take.rate).astype(np.int64) + take.first_frame


def face_box(take: MarkerTake) -> tuple[int, int, int, int]:
    """Return the box of the dots in all images, with a margin: left, top, right, bottom [px]."""
    places = take.positions * (1.0, -1.0)
    low, high = np.nanmin(places, axis=(0, 1)), np.nanmax(places, axis=(0, 1))
    room = _ROOM * float((high - low).max()) + 10
    low, high = np.maximum(low - room, 0.0), high + room
    if take.image_size:
        high = np.minimum(high, take.image_size)
    left, top = low.astype(int).tolist()
    right, bottom = np.maximum(high, low + 1).astype(int).tolist()
    return left, top, right, bottom


def footage_data(
    take: MarkerTake,
    images: Mapping[int, bytes],
    box: tuple[int, int, int, int],
    confidence: Mapping[str, Sequence[float]],
) -> dict[str, Any]:
    """Return images with dots, for `usdface.page.packed_data.pack_data`.

    Parameters
    ----------
    take : MarkerTake
        2D.
    images : mapping of int to bytes
        JPEG of the part in the box, by frame index.
    box : (int, int, int, int)
        Left, top, right, bottom [px].
    confidence : mapping of str to sequence of float
        Of each marker in each frame; markers that are not named have none.
    """
    places: FloatArray = np.round(take.positions * (1.0, -1.0), 1)
    frames = []
    for frame, image in images.items():
        dots = [
            None if np.isnan(x) else [x, y, confidence[name][frame] if name in confidence else None]
            for name, (x, y) in zip(take.names, places[frame].tolist(), strict=True)
        ]
        address = f"data:image/jpeg;base64,{base64.b64encode(image).decode('ascii')}"
        frames.append({"frame": frame, "image": address, "dots": dots})
    return {"box": list(box), "names": list(take.names), "frames": frames}
