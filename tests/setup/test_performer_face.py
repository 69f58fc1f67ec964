from typing import Any

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.setup.performer_face import PerformerFace


def made(**changed: Any) -> PerformerFace:
    values: dict[str, Any] = {
        "markers": ("chin", "lip"),
        "vertices": [4, 9],
        "shifts": np.zeros((2, 3)),
        "rest": [[0.0, 1.0, 2.0], [0.0, 1.1, 2.0]],
        "frames": 30,
        "shapes": ("open",),
        "displacements": np.full((1, 2, 3), 0.01),
    }
    return PerformerFace(**(values | changed))


def test_its_arrays_are_frozen() -> None:
    face = made()
    for name in ("vertices", "shifts", "rest", "displacements"):
        assert not getattr(face, name).flags.writeable


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"vertices": [4]}, "vertices"),
        ({"shifts": np.zeros((2, 2))}, "shifts"),
        ({"rest": np.full((2, 3), np.nan)}, "rest"),
        ({"displacements": np.zeros((2, 2, 3))}, "displacements"),
        ({"displacements": np.full((1, 2, 3), np.inf)}, "displacements"),
        ({"markers": ("chin", "chin")}, "marker twice"),
        ({"shapes": ("a", "a"), "displacements": np.zeros((2, 2, 3))}, "blend shape twice"),
        ({"frames": -1}, "frames"),
    ],
)
def test_what_does_not_belong_together_is_said(changed: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        made(**changed)
