from dataclasses import replace

import numpy as np
import pytest
from painted import GREEN, layout, paint
from scipy import ndimage

from usdface.footage.choose_channel import choose_model
from usdface.footage.detect import background, detect_dots
from usdface.footage.dots import Dots


def errors(found: Dots, true: np.ndarray) -> np.ndarray:
    away = np.linalg.norm(found.centres[:, None] - true, axis=2)
    assert len(found) == len(true)
    return away.min(axis=0)


def test_centres_are_those_of_the_discs_to_a_twentieth_of_a_pixel() -> None:
    true = layout()
    pixels = paint(true)
    found = detect_dots(pixels, choose_model(pixels))
    assert np.sqrt((errors(found, true) ** 2).mean()) < 0.05


def test_noise_makes_the_error_that_is_stated() -> None:
    true = layout()
    worlds = [paint(true, noise=8.0, seed=seed) for seed in range(6)]
    model = choose_model(worlds[0])
    found = [detect_dots(pixels, model) for pixels in worlds]
    error = np.sqrt(np.mean([(errors(dots, true) ** 2).mean() / 2 for dots in found]))
    stated = np.sqrt(np.mean([(dots.deviations**2).mean() for dots in found]))
    assert 0.5 < error / stated < 2.0


@pytest.mark.parametrize("shape", [(20, 2500), (2500, 20), (1, 100)])
def test_a_strip_of_an_image_has_a_background(shape: tuple[int, int]) -> None:
    np.testing.assert_allclose(background(np.full(shape, 7.0, np.float32)), 7.0)


def test_a_slanted_dot_is_an_ellipse() -> None:
    true = layout()
    pixels = paint(true, stretch=(0.6, 1.2))
    found = detect_dots(pixels, choose_model(pixels))
    assert errors(found, true).max() < 0.2
    assert np.allclose(found.roundness, 0.5, atol=0.05)
    assert np.allclose(np.abs(found.angles), np.pi / 2, atol=0.1)
    assert np.allclose(found.fills, 1.0, atol=0.08)


@pytest.mark.slow
def test_two_dots_that_run_into_each_other_in_a_soft_image_are_two() -> None:
    true = layout()
    true[1] = true[0] + (11.0, 3.0)  # 11 px apart, 10 px across
    size = (960, 720)
    soft = ndimage.gaussian_filter(paint(true, noise=0.0, size=size), (1.8, 1.8, 0))
    model = choose_model(paint(np.delete(true, 1, axis=0), size=size))
    error = errors(detect_dots(soft, model), true)
    assert error[:2].max() < 0.6
    assert error[2:].max() < 0.1


def test_a_dot_at_the_edge_of_the_face_is_found_as_a_slanted_line() -> None:
    true = np.concatenate([layout(), [[245.3, 150.6]]])
    pixels = paint(true[:-1], noise=0.0)
    model = replace(choose_model(pixels), area=75.0)
    y, x = np.mgrid[0.125:220:0.25, 0.125:280:0.25] - true[-1, ::-1, None, None]
    line = np.hypot((x + y) / np.sqrt(2) / 5.5, (x - y) / np.sqrt(2) / 0.5) < 1.0
    cover = line.reshape(220, 4, 280, 4).mean(axis=(1, 3))[..., None]
    mixed = pixels + cover * (np.array(GREEN) - pixels)
    soft = ndimage.gaussian_filter(mixed, (0.6, 0.6, 0)).round().astype(np.uint8)
    assert errors(detect_dots(soft, model), true)[-1] < 0.1


def test_a_part_of_an_image_gives_the_same_dots() -> None:
    pixels = paint(layout())
    model = choose_model(pixels)
    whole, part = detect_dots(pixels, model), detect_dots(pixels, model, (30, 20, 280, 220))
    order, other = np.argsort(whole.centres[:, 0]), np.argsort(part.centres[:, 0])
    assert np.allclose(whole.centres[order], part.centres[other], atol=0.03)


def test_a_thing_of_another_hue_is_no_dot() -> None:
    true = layout()
    pixels = paint(true)
    model = choose_model(pixels)
    pixels[180:192, 200:212] = (70, 130, 200)  # stands out in green above red, too
    assert len(detect_dots(pixels, model)) == len(true)


def test_a_dot_that_is_mixed_with_skin_is_faint() -> None:
    true = layout()
    pixels = paint(true)
    model = choose_model(pixels)
    skin = paint(true[:0])
    x, y = true[0].astype(int)
    around = np.s_[y - 8 : y + 8, x - 8 : x + 8]
    mixed = pixels.copy()
    mixed[around] = np.rint(0.78 * skin[around] + 0.22 * pixels[around])
    lower = replace(model, threshold=0.3 * model.threshold)
    assert not detect_dots(pixels, lower).faint.any()
    found = detect_dots(mixed, lower)
    assert errors(found, true).max() < 0.4
    assert np.flatnonzero(found.faint).tolist() == [int(np.argmin(found.heights))]
    assert len(found.sure) == len(true) - 1


@pytest.mark.parametrize("size", [(1, 1), (2, 40), (40, 2)])
def test_tiny_images_have_no_dots(size: tuple[int, int]) -> None:
    model = choose_model(paint(layout()))
    assert len(detect_dots(np.zeros((*size, 3), np.uint8), model)) == 0
