import copy
import pickle
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest
from worlds import make_world

import usdface


def arrays(value: Any) -> list[np.ndarray]:
    """Return the arrays in a value, however deep."""
    if isinstance(value, np.ndarray):
        return [value]
    parts: Any = ()
    if isinstance(value, Mapping):
        parts = value.values()
    elif isinstance(value, tuple | list):
        parts = value
    elif is_dataclass(value):
        parts = (getattr(value, field.name) for field in fields(value))
    return [array for part in parts for array in arrays(part)]


@pytest.mark.parametrize(
    "again", [lambda value: pickle.loads(pickle.dumps(value, 4)), copy.deepcopy]
)
def test_arrays_of_unpickled_and_copied_values_are_read_only(again: Callable[[Any], Any]) -> None:
    world = make_world()
    shot, _ = usdface.assemble_shot(world.rig, world.take, setup=world.setup())
    result = usdface.retarget(shot)
    for value in (world.rig, world.take, shot, result, result.weights):
        assert not any(array.flags.writeable for array in arrays(value))
        found = arrays(again(value))
        assert len(found) == len(arrays(value)) > 0
        assert not any(array.flags.writeable for array in found)
    with pytest.raises(ValueError, match="read-only"):
        again(result).weights.weights[0] = 1.0
