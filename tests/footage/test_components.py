import numpy as np

from usdface.arrays import FloatArray
from usdface.footage.components import find_components

RADIUS = 6.0
AREA = np.pi * RADIUS**2


def discs(*dots: tuple[float, float, float]) -> FloatArray:
    """An image of blurred discs, each with x, y and height."""
    y, x = np.mgrid[:60, :120]
    each = [h / (1 + np.exp(np.hypot(x - a, y - b) - RADIUS)) for a, b, h in dots]
    return np.max(each, axis=0)


def sizes(image: FloatArray, threshold: float, area: float = 0.0) -> list[int]:
    return np.bincount(find_components(image, threshold, area)[0].ravel())[1:].tolist()


def test_a_dot_in_the_shade_is_nearly_as_large_as_one_in_the_light() -> None:
    image = discs((30, 30, 100), (90, 30, 25))
    light, shade = sizes(image, 10.0)
    assert 0.85 * light < shade < light
    assert (image[:, 60:] > 10.0).sum() < 0.7 * (image[:, :60] > 10.0).sum()


def test_a_faint_dot_is_whole_where_the_usual_area_is_known() -> None:
    image = discs((30, 30, 100), (90, 30, 22))
    assert sizes(image, 20.0)[1] < 0.5 * AREA
    assert sizes(image, 20.0, AREA)[1] > 0.8 * AREA


def test_two_dots_that_touch_are_split_where_the_usual_area_is_known() -> None:
    image = discs((50, 30, 100), (62, 30, 100))
    assert len(sizes(image, 30.0)) == 1
    labels, count = find_components(image, 30.0, AREA)
    assert count == 2 and labels[30, 50] != labels[30, 62]


def test_an_image_without_dots_has_none() -> None:
    labels, count = find_components(np.zeros((20, 20)), 1.0, AREA)
    assert count == 0 and not labels.any()
