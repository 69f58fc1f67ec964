"""A setup in which no field has its default, for the ways out to a file and back."""

from collections.abc import Callable
from dataclasses import fields

from usdface.content_digest import content_digest
from usdface.options import CleanOptions, ClosureOptions, MapOptions, SolveOptions
from usdface.setup.binding import Binding
from usdface.setup.binding_origin import BindingOrigin
from usdface.setup.calibration import Calibration
from usdface.setup.pin import Pin
from usdface.setup.retarget_setup import RetargetSetup

__all__ = ["PLAIN", "WHOLE", "lost_fields", "other_fields"]

PLAIN = RetargetSetup(Binding((), []))
WHOLE = RetargetSetup(
    Binding(("a", "b", "ä ö"), [3, 3, 0], "/Head", [0.5, 0.25, 1.0]),
    head="markers",
    head_markers=("a", "b", "ä ö"),
    move_head=False,
    head_joint="neck/head",
    eye_joints=("eye.L", "eye.R"),
    eye_turn=0.25,
    neutral=(4, 40),
    neutral_assumed=True,
    neutral_removed=True,
    neutral_weights={"jawOpen": 0.125, "mouthFrown_L": 0.0625},
    peaks=(51, 7),
    nose_tip="a",
    roles={"lip_lower": "b"},
    map=MapOptions(kernel="gaussian", choice="fixed", form="paper", radius=2.0, smoothing=0.25),
    solve=SolveOptions(mode="frame", limits="known", prior="fixed", agility=20.0, sparsity=0.5),
    clean=CleanOptions(blinks=False, swaps=False, spikes=False, gaps=False),
    closure=ClosureOptions(lids=False, lips=False),
    pins=(Pin("jawOpen", [0], [0.5]),),
    calibration=Calibration(("jawOpen",), [1.25], [0.0625]),
    curves={"jawOpen": {"mouth-open": 0.75, "chin": -0.5}, "tongueOut": {}},
    exaggeration={"face": 1.25, "brows": 1.5},
    unsure=Binding(("c",), [7], "/Head", [0.125]),
    origin=BindingOrigin(8, 6, "0123456789abcdef"),
)


def other_fields(one: RetargetSetup, other: RetargetSetup) -> set[str]:
    """The fields in which two setups differ."""
    return {
        field.name
        for field in fields(one)
        if content_digest(getattr(one, field.name)) != content_digest(getattr(other, field.name))
    }


def lost_fields(there_and_back: Callable[[RetargetSetup], RetargetSetup]) -> set[str]:
    """The fields of a setup that are other ones after the way to a file and back."""
    same = {field.name for field in fields(WHOLE)} - other_fields(WHOLE, PLAIN)
    assert not same, f"give {same} another value than the default in tests/whole_setup.py"
    return other_fields(WHOLE, there_and_back(WHOLE))
