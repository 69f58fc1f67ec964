from dataclasses import replace

import numpy as np
from worlds import make_world

from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.setup.setup_summary import bound_count, neutral_summary, proposal_summary
from usdface.takes import WeightsTake

SETUP = RetargetSetup(Binding(("chin", "nose"), np.array([3, 1])), neutral=(2, 5))


def test_a_take_of_markers_counts_only_the_bound_ones_that_it_has() -> None:
    take = make_world().take
    own = replace(SETUP, binding=Binding((take.names[0], "absent"), np.array([0, 1])))
    assert bound_count(own, take) == 1
    weights = WeightsTake(("jawOpen",), np.zeros(1), np.zeros((1, 1)), 30.0)
    assert bound_count(own, weights) == 2


def test_the_neutral_is_frames_or_the_rig() -> None:
    assert neutral_summary(SETUP) == [2, 5]
    assert neutral_summary(replace(SETUP, neutral=None)) == "rig"


def test_only_a_proposal_has_frames_and_confidence() -> None:
    assert proposal_summary(SETUP) == {}
    unsure = Binding(("chin", "nose"), np.array([3, 1]), confidence=np.array([0.5, np.nan]))
    assert proposal_summary(replace(SETUP, binding=unsure, peaks=(7, 9))) == {
        "neutral_frames": [2, 5],
        "peak_frames": [7, 9],
        "confidence_mean": 0.5,
        "confidence_min": 0.5,
    }
