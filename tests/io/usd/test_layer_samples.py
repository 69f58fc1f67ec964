import numpy as np
from pxr import Sdf

from usdface.io.usd.layer_samples import write_arrays, write_samples, write_value

KINDS = Sdf.ValueTypeNames


def prim_of(layer: Sdf.Layer) -> Sdf.PrimSpec:
    return Sdf.CreatePrimInLayer(layer, "/Face")


def test_samples_and_values_are_those_given() -> None:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    write_samples(prim_of(layer), "curve", KINDS.Float, [1.0, 2.5], [0.25, 0.5])
    write_value(prim_of(layer), "title", KINDS.String, "chin")
    path = Sdf.Path("/Face.curve")
    assert layer.ListTimeSamplesForPath(path) == [1.0, 2.5]
    assert layer.QueryTimeSample(path, 2.5) == 0.5
    assert layer.GetAttributeAtPath("/Face.title").variability == Sdf.VariabilityUniform
    assert layer.GetAttributeAtPath("/Face.title").default == "chin"


def test_an_attribute_that_is_there_is_authored_again() -> None:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    for value in (0.25, 0.75):
        write_samples(prim_of(layer), "curve", KINDS.Float, [1.0], [value])
    assert layer.QueryTimeSample("/Face.curve", 1.0) == 0.75


def test_rows_are_arrays_of_floats_or_vectors() -> None:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    codes, rows = np.array([1.0, 2.0]), np.arange(12.0).reshape(2, 2, 3)
    write_arrays(prim_of(layer), "points", KINDS.Point3fArray, codes, rows)
    write_arrays(prim_of(layer), "weights", KINDS.FloatArray, codes, rows[..., 0])
    np.testing.assert_array_equal(layer.QueryTimeSample("/Face.points", 2.0), rows[1])
    np.testing.assert_array_equal(layer.QueryTimeSample("/Face.weights", 1.0), rows[0, :, 0])
