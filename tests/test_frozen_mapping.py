import copy
import pickle
from collections.abc import Callable
from typing import Any

import pytest
from worlds import make_world

import usdface
from usdface.content_digest import content_digest
from usdface.frozen_mapping import FrozenMapping


def test_it_is_a_mapping_that_nobody_changes() -> None:
    source = {"brow": "brow_in_l"}
    held = FrozenMapping(source)
    source["lip"] = "chin"
    assert held == {"brow": "brow_in_l"} and repr(held) == "{'brow': 'brow_in_l'}"
    with pytest.raises(TypeError):
        held["lip"] = "chin"  # type: ignore[index]


def test_it_is_copied_and_joined_like_a_dict() -> None:
    held = FrozenMapping({"brow": 1, "lip": 2})
    held.copy()["lip"] = 3
    assert held | {"lip": 3} == {"brow": 1, "lip": 3} and held["lip"] == 2
    assert {"lip": 3} | held == {"lip": 2, "brow": 1} == held | held
    assert list(reversed(held)) == ["lip", "brow"]


def by_pickle(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


@pytest.mark.parametrize("again", [by_pickle, copy.deepcopy])
def test_values_of_a_retarget_leave_their_process_unchanged(again: Callable[[Any], Any]) -> None:
    world = make_world()
    setup = world.setup(roles={"nose": "nose"}, curves={"jaw": {"jawOpen": 0.5}})
    shot, findings = usdface.assemble_shot(world.rig, world.take, setup=setup)
    result = usdface.retarget(shot)
    for value in (world.rig, world.take, setup, shot, result, findings, result.weights):
        assert content_digest(again(value)) == content_digest(value)
    assert content_digest(usdface.retarget(again(shot))) == content_digest(result)
    with pytest.raises(TypeError):
        again(shot).setup.roles["nose"] = "chin"
