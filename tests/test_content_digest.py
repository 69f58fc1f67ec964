"""Digests of values: any bit counts, also of what looks alike."""

from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType

import numpy as np
import pytest

from usdface.content_digest import content_digest, known_digest


@dataclass(frozen=True)
class Pair:
    one: object
    other: object


@dataclass(frozen=True)
class Other:
    one: object
    other: object


ALIKE = [
    *(None, False, 0, 0.0, -0.0, "0", b"0", b"str:0", "", float("nan"), 5e-324),
    *((), [], {}, (0,), (0, 0), ((0,), 0), (("a", "b"),), ("ab",), ("a", "b")),
    *({"a": 1, "b": 2}, {"b": 2, "a": 1}, Pair(0, 1), Pair(1, 0), Other(0, 1)),
    *(np.zeros(2), np.zeros((2, 1)), np.zeros(2, np.float32), np.array([0.0, 5e-324])),
    *(np.zeros(2, np.int64), np.array(0.0), np.array([np.nan, 0.0])),
]


def test_different_values_have_different_digests() -> None:
    digests = [content_digest(value) for value in ALIKE]
    assert len(set(digests)) == len(ALIKE)


def test_equal_values_have_equal_digests() -> None:
    array = np.arange(12.0).reshape(3, 4)
    assert content_digest(array) == content_digest(np.asfortranarray(array))
    assert content_digest(array[:, ::2]) == content_digest(array[:, ::2].copy())
    assert content_digest({"a": 1}) == content_digest(MappingProxyType({"a": 1}))


@pytest.mark.parametrize("value", [object(), {1, 2}, np.array([None]), (lambda: 0,)])
def test_what_is_not_known_has_none(value: object) -> None:
    with pytest.raises(TypeError, match="no digest"):
        content_digest(value)


def test_a_value_of_another_package_has_no_known_digest() -> None:
    assert known_digest((1, 2.0)) == content_digest((1, 2.0))
    assert known_digest((1, Fraction(1, 3))) == ""
