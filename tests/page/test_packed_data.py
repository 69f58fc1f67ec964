import base64
import gzip
import json
from typing import Any

import numpy as np
import pytest

from usdface.page.packed_data import PageData, Quantized, pack_data


def unpacked(data: PageData) -> Any:
    """Read the data as the page does (`assets/data.js`)."""
    block = gzip.decompress(base64.b64decode(data.block))

    def revived(value: Any) -> Any:
        if isinstance(value, list):
            return [revived(each) for each in value]
        if not isinstance(value, dict):
            return value
        if "array" not in value:
            return {name: revived(each) for name, each in value.items()}
        entry = value["array"]
        kind = np.dtype(entry["type"].replace("u", "uint").replace("f", "float"))
        count = int(np.prod(entry["shape"]))
        stored = np.frombuffer(block, kind, count, entry["at"]).reshape(entry["shape"])
        if kind.kind == "f":
            return stored
        values = np.cumsum(stored, axis=0, dtype=kind) if count else stored
        if "step" not in entry:
            return values
        numbers = entry["low"] + entry["step"] * values.astype(np.float64)
        return np.where(values == np.iinfo(kind).max, np.nan, numbers)

    return revived(json.loads(data.text))


def test_whole_numbers_come_back_exactly() -> None:
    generator = np.random.default_rng(1)
    tree = {
        str(high): generator.integers(0, high, size=(7, 3)) for high in (2, 256, 65536, 2**32 - 1)
    }
    tree |= {"none": np.zeros((0, 3), np.int64), "falling": np.array([9, 3, 300, 0])}
    back = unpacked(pack_data({"a": [tree]}))["a"][0]
    for name, values in tree.items():
        np.testing.assert_array_equal(back[name], values)


@pytest.mark.parametrize("bits", [8, 16])
def test_numbers_come_back_to_half_a_step(bits: int) -> None:
    values = np.random.default_rng(2).normal(size=(40, 2, 3))
    values[3, 1], values[:, 0, 2] = np.nan, np.inf
    back = unpacked(pack_data({"a": Quantized(values, bits)}))["a"]
    seen = np.isfinite(values)
    step = np.ptp(values[seen]) / (2**bits - 2)
    assert np.abs(back[seen] - values[seen]).max() <= 0.5001 * step
    assert np.isnan(back[~seen]).all()


@pytest.mark.parametrize("value", [0.0, -3.25, np.nan])
def test_one_value_everywhere_is_exact(value: float) -> None:
    back = unpacked(pack_data({"a": Quantized(np.full((3, 2), value))}))["a"]
    np.testing.assert_array_equal(back, np.full((3, 2), value))


def test_float32_comes_back_exactly_and_what_is_not_finite_is_null() -> None:
    values = np.random.default_rng(3).normal(size=(5, 3)).astype(np.float32)
    back = unpacked(pack_data({"a": values, "b": [np.inf, float("nan"), 0.5]}))
    np.testing.assert_array_equal(back["a"], values)
    assert back["b"] == [None, None, 0.5]


def test_numbers_that_are_not_whole_are_not_taken_for_such() -> None:
    with pytest.raises(TypeError, match="quantised"):
        pack_data({"a": np.zeros(3)})


def test_the_same_data_gives_the_same_bytes() -> None:
    tree = {"a": Quantized(np.linspace(0, 1, 50)), "b": ["x", None, {"c": 1.5}]}
    assert pack_data(tree) == pack_data(tree)
    assert unpacked(pack_data(tree))["b"] == ["x", None, {"c": 1.5}]
