import numpy as np
import pytest
from clips import plays, weights_of_stage

from usdface.errors import InputError
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.takes import WeightsTake


def test_weights_come_in_seconds_by_time_codes_per_second(face_rig, tmp_path):
    given = WeightsTake(face_rig.shape_names, [0.5, 0.6, 0.7], np.eye(3, 4), 60.0)
    write_rig(face_rig, tmp_path / "rig.usda", plays(given))
    stage = open_stage(tmp_path / "rig.usda")
    stage.SetFramesPerSecond(24)  # for display only
    found = weights_of_stage(stage)
    assert found.names == given.names
    np.testing.assert_allclose(found.times, given.times, atol=1e-12)
    np.testing.assert_array_equal(found.weights, given.weights)


def test_a_rig_at_rest_has_no_weights_take(face_rig, tmp_path):
    write_rig(face_rig, tmp_path / "rig.usda")
    assert weights_of_stage(open_stage(tmp_path / "rig.usda")) is None


def test_a_sample_of_the_wrong_length_is_named(shared_data):
    with pytest.raises(InputError, match="2 blendShapeWeights for 1 blendShapes at time code 5"):
        weights_of_stage(open_stage(shared_data / "mayausd_morpher" / "morpher_box.usd"))
