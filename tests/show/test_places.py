"""Places that a farm names."""

import pytest

from usdface.errors import InputError
from usdface.show.places import places


@pytest.mark.parametrize("index", ["6", "-1", "2-1", "a", "1-", "1-6", "1-2-3", "٣"])
def test_a_wrong_index_is_refused(index: str) -> None:
    with pytest.raises(InputError, match="--index"):
        places(index, 6, "--index", "shots")


def test_an_index_is_a_place_or_a_range() -> None:
    assert places("", 6, "--index", "shots") == range(6)
    assert places("2", 6, "--index", "shots") == range(2, 3)
    assert places("0-5", 6, "--index", "shots") == range(6)


def test_the_places_that_there_are_are_told() -> None:
    with pytest.raises(
        InputError, match=r"--piece 3: .* from 0 to 0, as the number of pieces is 1"
    ):
        places("3", 1, "--piece", "pieces")
