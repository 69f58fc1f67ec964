"""Dots of all images of a film, a batch at a time: memory does not grow with the film."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import islice

import numpy as np

from usdface.footage.choose_channel import LEAST_DOTS, MOST_DOTS
from usdface.footage.colour_channel import Pixels
from usdface.footage.detect import CUT_OUT, Box, DotModel, detect_dots
from usdface.footage.dots import Dots, no_dots

__all__ = ["LoadFrame", "scan"]

LoadFrame = Callable[[], Pixels | None]
"""Reads one frame: pixels (H, W, 3); None where there is no image."""

# Images that are processed in parallel; the region of interest and the model of the dots follow
# from the batch before, so that the result does not depend on the number of threads.
_BATCH = 16
_THREADS = 2
# Margin around the dots, as a share of their extent; and the rim that they must not reach, as a
# share of the box with its margin.
_ROOM, _RIM = 0.15, 0.03
# An image with fewer dots than this share of the usual number is searched as a whole.
_FEWER = 0.8
# Largest factor on the threshold from batch to batch, as it follows the light.
_CHANGE = 1.5


def scan(frames: Iterable[LoadFrame], model: DotModel) -> Iterator[Dots]:
    """Yield the dots of each frame, in order.

    Parameters
    ----------
    frames : iterable of callable
        Called from several threads.
    model : DotModel
        Of the first images; threshold and area follow the light and the size of the face.
    """
    box: Box | None = None
    usual = 0.0
    coming = iter(frames)
    with ThreadPoolExecutor(_THREADS) as pool:
        while batch := list(islice(coming, _BATCH)):
            look = partial(_found, model=model, box=box, usual=usual)
            found = list(pool.map(look, batch))
            yield from (dots for dots, _ in found)
            sure = [(dots.sure, size) for dots, size in found]
            model = _adapted(model, [dots for dots, _ in sure])
            seen = [each for each in sure if len(each[0]) >= LEAST_DOTS]
            if seen:
                usual = float(np.median([len(dots) for dots, _ in seen]))
                box = _room(seen[-1][0], seen[-1][1])


def _found(
    load: LoadFrame, model: DotModel, box: Box | None, usual: float
) -> tuple[Dots, tuple[int, int]]:
    pixels = load()
    if pixels is None:
        return no_dots(), (0, 0)
    size = pixels.shape[1], pixels.shape[0]
    dots = detect_dots(pixels, model, box)
    sure = dots.sure
    if box is not None and (len(sure) < _FEWER * usual or _at_rim(sure, box, size)):
        dots = detect_dots(pixels, model)
    return (dots if len(dots) <= 4 * MOST_DOTS else no_dots()), size


def _room(dots: Dots, size: tuple[int, int]) -> Box:
    """Return the part of an image of a size in which the dots are searched next."""
    low, high = dots.centres.min(axis=0), dots.centres.max(axis=0)
    room = _ROOM * float((high - low).max()) + 4 * float(dots.radii.max())
    left, top = np.maximum(low - room, 0).astype(int).tolist()
    right, bottom = np.minimum(high + room + 1, size).astype(int).tolist()
    return left, top, right, bottom


def _at_rim(dots: Dots, box: Box, size: tuple[int, int]) -> bool:
    """Return whether a dot is near to a side of the box that is not the image's own."""
    rim = _RIM * max(box[2] - box[0], box[3] - box[1])
    low, high = dots.centres.min(axis=0), dots.centres.max(axis=0)
    near = (low - box[:2] < rim) & (np.array(box[:2]) > 0)
    far = (box[2:] - high < rim) & (np.array(box[2:]) < size)
    return bool(near.any() or far.any())


def _adapted(model: DotModel, batch: list[Dots]) -> DotModel:
    """Return the model of the dots with the light and the size of a batch."""
    heights = np.concatenate([dots.heights for dots in batch])
    if len(heights) < LEAST_DOTS:
        return model
    areas = np.concatenate([dots.areas for dots in batch])
    usual = (areas > 0.4 * model.area) & (areas < 2.5 * model.area)
    if usual.sum() < LEAST_DOTS:
        return model
    wanted = CUT_OUT * float(np.median(heights[usual]))
    threshold = float(np.clip(wanted, model.threshold / _CHANGE, model.threshold * _CHANGE))
    return replace(model, threshold=threshold, area=float(np.median(areas[usual])))
