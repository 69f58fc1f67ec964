import numpy as np
import pytest
from painted import layout, paint

from usdface.errors import InputError
from usdface.footage.choose_channel import choose_model, colour_at, model_of_colour
from usdface.footage.colour_channel import parse_colour
from usdface.footage.detect import detect_dots

PAINTS = {
    "green": (60, 165, 90),
    "blue": (60, 80, 190),
    "yellow": (235, 220, 60),
    "magenta": (200, 40, 170),
    "black": (25, 22, 20),
    "white": (252, 252, 252),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PAINTS)
def test_the_colour_of_the_dots_is_found(name: str) -> None:
    true = layout()
    pixels = paint(true, colour=PAINTS[name])
    found = detect_dots(pixels, choose_model(pixels))
    away = np.linalg.norm(found.centres[:, None] - true, axis=2).min(axis=0)
    assert len(found) == len(true) and away.max() < 0.3


@pytest.mark.slow
@pytest.mark.parametrize("name", PAINTS)
def test_a_colour_by_name_or_by_a_click_finds_these_dots_among_others(name: str) -> None:
    true = layout()
    other = "green" if name != "green" else "blue"
    pixels = paint(true[:12], colour=PAINTS[name])
    beside = paint(true[12:], colour=PAINTS[other])
    here = np.abs(beside.astype(int) - paint(true[:0])).max(axis=2) > 40
    pixels[here] = beside[here]
    place = float(true[3, 0]), float(true[3, 1])
    for model in (
        model_of_colour(pixels, parse_colour(name), None),
        model_of_colour(pixels, *colour_at(pixels, place)),
    ):
        found = detect_dots(pixels, model)
        away = np.linalg.norm(found.centres[:, None] - true, axis=2).min(axis=1)
        mine = np.linalg.norm(found.centres[:, None] - true[:12], axis=2).min(axis=0)
        assert mine.max() < 0.4 and len(found) == 12, (model.channel.name, away)


def test_skin_alone_has_no_dots() -> None:
    with pytest.raises(InputError, match="no dots are found"):
        choose_model(paint(layout()[:0]))


def test_a_click_beside_the_image_is_refused() -> None:
    with pytest.raises(InputError, match="outside of the image"):
        colour_at(paint(layout()), (900.0, 10.0))


def test_colours_have_names_and_digits() -> None:
    assert parse_colour("#3a7") == parse_colour("#33aa77") == (0x33, 0xAA, 0x77)
    with pytest.raises(InputError, match="did you mean green"):
        parse_colour("gren")
    with pytest.raises(InputError, match="expected green"):
        parse_colour("#12345")
