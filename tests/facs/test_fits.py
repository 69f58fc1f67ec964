import numpy as np
import pytest

from usdface.facs.fits import fits_of
from usdface.facs.movements import MOVEMENTS, POINTS, prototype
from usdface.facs.shape_claims import Claim


def test_each_movement_fits_itself_best() -> None:
    claims = fits_of(np.ones((1, len(POINTS), 3))).candidates
    moved = np.array([prototype(MOVEMENTS[c.movement], c.side) for c in claims])
    fits = fits_of(moved)
    assert np.allclose(np.diagonal(fits.cosines), 1.0)
    others = fits.cosines - 2 * np.eye(len(claims))
    assert others.max() < 0.95


def test_a_mirror_image_is_that_of_the_other_half() -> None:
    fits = fits_of(np.ones((1, len(POINTS), 3)))

    def other(movement: str, side: str = "") -> str:
        return str(fits.candidates[fits.mirror(fits.candidates.index(Claim(movement, side)))])

    assert other("12", "L") == "AU12R"
    assert other("61", "L") == "AU62R"
    assert other("30L") == "AU30R"
    assert other("18") == "AU18"


def test_a_reading_is_the_way_and_its_noise() -> None:
    """Points that go 4 mm along their ways read 4 mm; chance is averaged over the points."""
    way = prototype(MOVEMENTS["34"], "L")
    lengths = np.linalg.norm(way, axis=1, keepdims=True)
    moved = 4.0 * np.divide(way, lengths, out=np.zeros_like(way), where=lengths > 0)
    random = np.random.default_rng(2).normal(0.0, 0.3, (2000, *way.shape))
    fits = fits_of(np.concatenate([moved[None], random]))
    k = fits.candidates.index(Claim("34", "L"))
    reading = fits.reading(0, k, 0.3)
    assert reading.mean == pytest.approx(4.0)
    assert all(value == pytest.approx(4.0) for value in reading.points.values())
    chance = [fits.reading(row, k, 0.3).in_noise for row in range(1, 2001)]
    assert np.std(chance) == pytest.approx(1.0, abs=0.06)
