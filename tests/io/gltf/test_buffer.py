from pathlib import Path

import numpy as np
import pygltflib
import pytest

from usdface.errors import OutputError
from usdface.io.gltf.accessors import AccessorReader
from usdface.io.gltf.buffer import BufferBuilder
from usdface.io.gltf.document import GltfFile


def reader_of(builder: BufferBuilder) -> AccessorReader:
    document = pygltflib.GLTF2(accessors=builder.accessors, bufferViews=builder.views)
    return AccessorReader(GltfFile(document, (), (b"".join(builder.blob),), Path()))


def test_a_number_beyond_float32_cannot_be_written() -> None:
    with pytest.raises(OutputError, match="32-bit"):
        BufferBuilder().array(np.array([[1e39]]))


@pytest.mark.parametrize("width", [2, 3, 4])
@pytest.mark.parametrize("short", ["signed", "unsigned"])
def test_shorts_are_off_by_half_a_step(width: int, short: str) -> None:
    low = -1 if short == "signed" else 0
    values = np.random.default_rng(width).uniform(low, 1, (9, width))
    builder = BufferBuilder(shorts=True)
    index = builder.array(values, pygltflib.ARRAY_BUFFER, short=short)  # type: ignore[arg-type]
    back = reader_of(builder).floats(index, f"VEC{width}")
    steps = 2**15 - 1 if short == "signed" else 2**16 - 1
    assert np.abs(back - values).max() <= 0.5 / steps + 1e-7
    view = builder.views[builder.accessors[index].bufferView]
    assert (view.byteStride or 2 * width) % 4 == 0


def test_numbers_that_shorts_do_not_hold_stay_floats() -> None:
    builder = BufferBuilder(shorts=True)
    values = np.array([[0.5, 1.5]])
    index = builder.array(values, pygltflib.ARRAY_BUFFER, short="signed")
    np.testing.assert_array_equal(reader_of(builder).floats(index, "VEC2"), values)


@pytest.mark.parametrize("moved", [0, 2, 90])
def test_offsets_as_shorts_come_back_sparse_or_dense(moved: int) -> None:
    values = np.random.default_rng(moved).uniform(-1, 1, (moved, 3))
    builder = BufferBuilder(shorts=True)
    index = builder.offsets(np.arange(moved), values, 100)
    rows, back = reader_of(builder).offsets(index, 100)
    np.testing.assert_array_equal(rows, np.arange(moved))
    np.testing.assert_allclose(back, values, rtol=0, atol=0.5 / (2**15 - 1) + 1e-7)
