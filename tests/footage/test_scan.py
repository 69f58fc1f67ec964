from collections.abc import Iterator
from functools import partial

import numpy as np
import pytest
from painted import paint, performance

from usdface.footage.choose_channel import choose_model
from usdface.footage.colour_channel import Pixels
from usdface.footage.scan import LoadFrame, scan


def frame(places: np.ndarray, number: int, light: float = 1.0) -> Pixels:
    pixels = paint(places[number], seed=number, size=(400, 320))
    return (pixels * light).astype(np.uint8)


@pytest.mark.slow
def test_each_image_is_looked_at_once_and_few_are_held() -> None:
    places, _ = performance(50)
    asked: list[int] = []
    done: list[int] = []

    def load(number: int) -> Pixels:
        done.append(number)
        return frame(places, number)

    def loads() -> Iterator[LoadFrame]:
        for number in range(len(places)):
            asked.append(number)
            yield partial(load, number)

    found = scan(loads(), choose_model(frame(places, 0)))
    next(found)
    assert len(asked) <= 16
    assert len(list(found)) == 49 and sorted(done) == list(range(50))


@pytest.mark.slow
def test_dots_are_found_while_the_light_falls_and_an_image_is_missing() -> None:
    places, _ = performance(64)
    lights = np.linspace(1.0, 0.35, 64).tolist()
    loads: list[LoadFrame] = [partial(frame, places, k, lights[k]) for k in range(64)]
    loads[20] = lambda: None
    counts = [len(dots) for dots in scan(loads, choose_model(frame(places, 0)))]
    assert counts[20] == 0
    assert counts[:20] + counts[21:] == [20] * 63


@pytest.mark.slow
def test_a_head_that_leaves_the_part_that_is_looked_at_is_found() -> None:
    places, _ = performance(40, motion=0.2)
    places[25:] += (110.0, 70.0)
    loads = [partial(frame, places, k) for k in range(40)]
    assert [len(dots) for dots in scan(loads, choose_model(frame(places, 0)))] == [20] * 40
