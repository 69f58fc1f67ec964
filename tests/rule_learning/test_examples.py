from dataclasses import replace

import numpy as np
import pytest
from fit_world import make_examples

from usdface.errors import InputError


def test_rows_are_found_by_emotion_and_variant():
    examples = make_examples()
    assert examples.names == ("joy", "surprise", "fear", "anger", "contempt")
    assert examples.rows("anger").sum() == 16
    assert examples.rows("anger", "open").sum() == 8
    assert examples.variants_of("anger") == ("closed", "open")
    fewer = examples.subset(examples.rows("anger", "open"))
    assert fewer.variants == ("open",) * 8
    assert fewer.features.shape == (8, 18)


@pytest.mark.parametrize(
    "wrong",
    [
        {"features": np.zeros((3, 18))},
        {"noise": np.zeros(3)},
        {"intensities": np.zeros(3)},
        {"movements": np.zeros((2, 3))},
        {"recordings": ("a",)},
    ],
)
def test_what_does_not_fit_is_refused(wrong):
    with pytest.raises(InputError, match=f"{next(iter(wrong))} of the examples have shape"):
        replace(make_examples(), **wrong)


@pytest.mark.parametrize("intensity", [0.0, 1.5, np.nan])
def test_an_intensity_lies_above_0_and_at_most_at_1(intensity):
    examples = make_examples()
    with pytest.raises(InputError, match="intensity"):
        replace(examples, intensities=np.full(len(examples.emotions), intensity))
