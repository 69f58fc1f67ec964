from pathlib import Path

import numpy as np
import pygltflib
import pytest

from usdface.errors import InputError
from usdface.io.gltf.accessors import AccessorReader
from usdface.io.gltf.buffer import BufferBuilder
from usdface.io.gltf.document import GltfFile


def reader_of(builder: BufferBuilder) -> AccessorReader:
    document = pygltflib.GLTF2(accessors=builder.accessors, bufferViews=builder.views)
    return AccessorReader(GltfFile(document, (), (b"".join(builder.blob),), Path()))


@pytest.mark.parametrize("dtype", ["<u1", "<u2", "<u4", "<i1", "<i2"])
def test_integers_come_back(dtype: str) -> None:
    rng = np.random.default_rng(1)
    limits = np.iinfo(dtype)
    values = rng.integers(limits.min, limits.max, (7, 4), endpoint=True).astype(dtype)
    builder = BufferBuilder()
    builder.view(b"x")  # so that it starts somewhere, aligned
    index = builder.array(values)
    assert builder.views[1].byteOffset == 4
    np.testing.assert_array_equal(reader_of(builder).integers(index, "VEC4"), values)


def test_floats_come_back_with_their_bounds() -> None:
    values = np.random.default_rng(2).normal(size=(9, 3))
    builder = BufferBuilder()
    index = builder.array(values, bounds=True)
    read = reader_of(builder).floats(index, "VEC3")
    np.testing.assert_array_equal(read, values.astype(np.float32))
    assert builder.accessors[index].min == read.min(axis=0).tolist()
    assert builder.accessors[index].max == read.max(axis=0).tolist()


@pytest.mark.parametrize("moved", [0, 1, 3, 40, 50])
@pytest.mark.parametrize("count", [50, 70_000])
def test_offsets_come_back_and_take_the_smaller_form(moved: int, count: int) -> None:
    rng = np.random.default_rng(moved)
    indices = np.sort(rng.choice(count, moved, replace=False))
    values = 1 + rng.random((moved, 3))
    builder = BufferBuilder()
    index = builder.offsets(indices, values, count)
    back, offsets = reader_of(builder).offsets(index, count)
    np.testing.assert_array_equal(back, indices)
    np.testing.assert_array_equal(offsets, values.astype(np.float32))
    sparse = moved * (12 + (2 if count < 2**16 else 4))
    assert sum(map(len, builder.blob)) == pytest.approx(min(sparse, 12 * count), abs=4)
    dense = np.zeros((count, 3), np.float32)
    dense[indices] = values
    assert builder.accessors[index].min == dense.min(axis=0).tolist()
    assert builder.accessors[index].max == dense.max(axis=0).tolist()


@pytest.mark.parametrize(
    ("dtype", "raw", "expected"),
    [
        ("<i1", [-128, -127, 0, 127], [-1, -1, 0, 1]),
        ("<u1", [0, 51, 255, 255], [0, 0.2, 1, 1]),
        ("<i2", [-32768, 0, 32767, 32767], [-1, 0, 1, 1]),
        ("<u2", [0, 13107, 65535, 0], [0, 0.2, 1, 0]),
    ],
)
def test_normalised_integers(dtype: str, raw: list[int], expected: list[float]) -> None:
    builder = BufferBuilder()
    index = builder.array(np.array([raw], dtype))
    builder.accessors[index].normalized = True
    np.testing.assert_allclose(reader_of(builder).floats(index, "VEC4"), [expected])


def test_integers_that_are_not_normalised_are_plain_numbers() -> None:
    builder = BufferBuilder()
    index = builder.array(np.array([[-5, 300, 7]], "<i2"))
    np.testing.assert_array_equal(reader_of(builder).floats(index, "VEC3"), [[-5, 300, 7]])


def test_interleaved_attributes() -> None:
    table = np.arange(24, dtype="<f4").reshape(4, 6)
    builder = BufferBuilder()
    view = builder.view(table.tobytes())
    builder.views[view].byteStride = 24
    for offset in (0, 12):
        builder.accessors.append(
            pygltflib.Accessor(
                bufferView=view, byteOffset=offset, componentType=5126, count=4, type="VEC3"
            )
        )
    np.testing.assert_array_equal(reader_of(builder).floats(0, "VEC3"), table[:, :3])
    np.testing.assert_array_equal(reader_of(builder).floats(1, "VEC3"), table[:, 3:])


def test_sparse_values_replace_dense_ones() -> None:
    builder = BufferBuilder()
    dense = builder.array(np.ones((5, 3)))
    sparse = builder.offsets(np.array([1, 4]), np.full((2, 3), 7.0), 100)
    builder.accessors[dense].sparse = builder.accessors[sparse].sparse
    expected = np.ones((5, 3))
    expected[[1, 4]] = 7
    np.testing.assert_array_equal(reader_of(builder).floats(dense, "VEC3"), expected)
    indices, offsets = reader_of(builder).offsets(dense, 5)
    np.testing.assert_array_equal(indices, np.arange(5))
    np.testing.assert_array_equal(offsets, expected)


def three_points() -> tuple[BufferBuilder, pygltflib.Accessor, pygltflib.BufferView]:
    builder = BufferBuilder()
    index = builder.array(np.ones((3, 3)))
    return builder, builder.accessors[index], builder.views[0]


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("count", 4),
        ("count", 10**12),
        ("count", 0),
        ("count", -1),
        ("count", None),
        ("byteOffset", 1),
        ("byteOffset", -4),
        ("type", "VEC2"),
        ("type", None),
        ("componentType", 5124),
        ("bufferView", 1),
        ("bufferView", -1),
        ("view.byteLength", 35),
        ("view.byteLength", 37),
        ("view.byteOffset", 4),
        ("view.byteOffset", -4),
        ("view.byteStride", 8),
        ("view.byteStride", 16),
        ("view.byteStride", -12),
        ("view.buffer", 1),
        ("view.buffer", None),
    ],
)
def test_what_reaches_beyond_its_data_is_refused(field: str, value: object) -> None:
    builder, accessor, view = three_points()
    owner, name = (view, field[5:]) if field.startswith("view.") else (accessor, field)
    setattr(owner, name, value)
    with pytest.raises(InputError):
        reader_of(builder).floats(0, "VEC3")


@pytest.mark.parametrize("index", [-1, 1, None, "0", 0.0])
def test_an_accessor_that_is_not_there(index: object) -> None:
    builder, _, _ = three_points()
    with pytest.raises(InputError, match="no accessor"):
        reader_of(builder).floats(index, "VEC3")


def test_zeros_cannot_be_more_than_the_file_could_hold() -> None:
    builder, _, _ = three_points()
    few = builder.zeros(36, 3)
    many = builder.zeros(10**12, 3)
    assert not reader_of(builder).floats(few, "VEC3").any()
    with pytest.raises(InputError, match="only 36 bytes"):
        reader_of(builder).floats(many, "VEC3")
    with pytest.raises(InputError, match="for 3 vertices"):
        reader_of(builder).offsets(many, 3)


@pytest.mark.parametrize("indices", [[1, 1], [2, 1], [1, 100]])
def test_sparse_indices_must_increase_and_fit(indices: list[int]) -> None:
    builder = BufferBuilder()
    index = builder.offsets(np.array(indices), np.ones((2, 3)), 100)
    with pytest.raises(InputError, match="increase"):
        reader_of(builder).offsets(index, 100)


@pytest.mark.parametrize("count", [10**12, 0, -1, None])
def test_sparse_counts_are_bounded(count: object) -> None:
    builder = BufferBuilder()
    index = builder.offsets(np.array([1]), np.ones((1, 3)), 100)
    builder.accessors[index].sparse.count = count
    with pytest.raises(InputError, match="sparse"):
        reader_of(builder).offsets(index, 100)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_from_outside_are_finite(bad: float) -> None:
    builder = BufferBuilder()
    view = builder.view(np.array([1, bad, 3], "<f4").tobytes())
    builder.accessors.append(
        pygltflib.Accessor(bufferView=view, componentType=5126, count=1, type="VEC3")
    )
    with pytest.raises(InputError, match="NaN"):
        reader_of(builder).floats(0, "VEC3")


def test_floats_are_no_joints() -> None:
    builder, _, _ = three_points()
    with pytest.raises(InputError, match="integers"):
        reader_of(builder).integers(0, "VEC3")


def test_zeros_that_are_only_named_take_nothing() -> None:
    """200 shapes of 100,000 vertices, of which each moves a few, are no large file."""
    builder = BufferBuilder()
    few = builder.offsets(np.array([5, 9]), np.ones((2, 3)), 100_000)
    none = builder.offsets(np.zeros(0, np.int64), np.zeros((0, 3)), 100_000)
    dense = builder.array(np.ones((7, 3)))
    reader = reader_of(builder)
    assert [reader.count(k) for k in (few, none, dense)] == [100_000, 100_000, 7]
    assert [reader.stored(k) for k in (few, none, dense)] == [2, 0, 7]
