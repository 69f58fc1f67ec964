import pytest
from worlds import make_world

import usdface


def test_an_unknown_setting_of_the_correction_is_named() -> None:
    world = make_world()
    with pytest.raises(usdface.InputError, match=r"no setting 'gian'.*did you mean gain") as raised:
        usdface.assemble_shot(world.rig, world.take, setup=world.setup(), correction={"gian": 1.0})
    assert raised.value.code == "SETTING_WRONG"


def test_a_shot_that_binds_no_marker_is_refused_without_a_warning_of_numpy() -> None:
    world = make_world()
    setup = usdface.RetargetSetup(usdface.Binding((), []))  # type: ignore[arg-type]
    shot = usdface.Shot(world.rig, world.take, setup)
    with pytest.raises(usdface.InputError, match="binds none of the markers of"):
        usdface.retarget(shot)


def test_a_head_joint_that_the_rig_lacks_is_refused() -> None:
    world = make_world()
    setup = world.setup(head_joint="Tail")
    with pytest.raises(usdface.InputError, match="the head's joint is 'Tail', but no") as raised:
        usdface.assemble_shot(world.rig, world.take, setup=setup)
    assert raised.value.code == "JOINT_UNKNOWN"
