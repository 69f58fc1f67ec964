from dataclasses import replace
from pathlib import Path

import pytest
from worlds import make_world

import usdface

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_an_unknown_setting_of_the_correction_is_named() -> None:
    world = make_world()
    with pytest.raises(usdface.InputError, match=r"no setting 'gian'.*did you mean gain") as raised:
        usdface.assemble_shot(world.rig, world.take, setup=world.setup(), correction={"gian": 1.0})
    assert raised.value.code == "SETTING_WRONG"


def test_the_options_of_the_correction_are_taken_whole_or_in_part() -> None:
    rig, _ = usdface.read_rig(EXAMPLES / "head.usdc")
    take, _ = usdface.read_take(EXAMPLES / "take.usdc")
    bind, _ = usdface.read_bind(EXAMPLES / "bind.json")
    options = usdface.CorrectionOptions(gain=0.7, ease=0.2)
    shot, _ = usdface.assemble_shot(rig, take, setup=bind, correction=options)
    system = shot.system
    assert system is not None and (system.mode, system.gain, system.ease) == ("raise", 0.7, 0.2)
    shot, _ = usdface.assemble_shot(
        rig, take, setup=bind, system=system, correction={"mode": "add", "gain": 0.5}
    )
    assert shot.system == replace(system, mode="add", gain=0.5)
    default = usdface.CorrectionOptions()
    shot, _ = usdface.assemble_shot(rig, take, setup=bind, system=system, correction=default)
    assert shot.system == replace(system, gain=1.0, ease=0.0)


def test_a_shot_that_binds_no_marker_is_refused_without_a_warning_of_numpy() -> None:
    world = make_world()
    setup = usdface.RetargetSetup(usdface.Binding((), []))  # type: ignore[arg-type]
    shot = usdface.Shot(world.rig, world.take, setup)
    with pytest.raises(usdface.InputError, match="binds none of the markers of"):
        usdface.retarget(shot)


def test_a_head_joint_that_the_rig_lacks_is_refused() -> None:
    world = make_world()
    setup = world.setup(head_joint="Tail")
    with pytest.raises(usdface.InputError, match=r"'Tail', but no.* moves the mesh;") as raised:
        usdface.assemble_shot(world.rig, world.take, setup=setup)
    assert raised.value.code == "JOINT_UNKNOWN"


def unread(
    system: usdface.ExpressionSystem | None = None, **changes: object
) -> list[dict[str, object]]:
    """Return the values of SETTING_UNREAD of a shot whose binding has these settings, too."""
    world = make_world()
    setup = world.setup(nose_tip="nose", neutral=(0, 3), **changes)
    _, findings = usdface.assemble_shot(world.rig, world.take, setup=setup, system=system)
    return [dict(f.values) for f in findings if f.code == "SETTING_UNREAD"]


def test_curves_of_a_binding_are_reported_where_the_take_has_markers() -> None:
    assert unread() == []
    assert unread(curves={"JawDrop": {"jawOpen": 1.0}}) == [{"attribute": "curves"}]


def test_roles_of_a_binding_without_effect_are_reported() -> None:
    world = make_world()
    roles = {"mouth_corner": "corner_l", "my-role": "chin", "horn": "horn_l"}
    assert unread(roles=roles) == [{"roles": ["my-role", "horn"]}]
    shot, _ = usdface.assemble_shot(world.rig, world.take, setup=world.setup(nose_tip="nose"))
    assert shot.system is not None
    read = {feature.role: feature.role for feature in shot.system.features}
    assert unread(shot.system, roles=read) == []
    assert unread(shot.system, roles=read | roles) == [{"roles": list(roles)}]
