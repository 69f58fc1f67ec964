from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import usdface
from usdface.options import ProcessOptions
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot.performance_measures import (
    idle_curves,
    performance_short,
    still_markers,
    still_weights,
)
from usdface.shot.report import report_of
from usdface.shot.shot import Shot
from usdface.takes import WeightsTake
from usdface.verdict import Verdict
from usdface.verdict.judge import judge

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture(scope="module")
def shot() -> Shot:
    rig, _ = usdface.read_rig(EXAMPLES / "head.usdc")
    take, _ = usdface.read_take(EXAMPLES / "take.usdc")
    setup, _ = usdface.read_bind(EXAMPLES / "bind.json")
    return usdface.assemble_shot(rig, take, setup=replace(setup, neutral=(0, 0)))[0]


def verdict_on(shot: Shot) -> Verdict:
    options = ProcessOptions(express=False, closure=False)
    verdict = report_of(usdface.retarget(shot, options=options)).verdict
    assert verdict is not None
    return verdict


def codes(verdict: Verdict) -> list[str]:
    return [reason.criterion.code for reason in verdict.reasons]


def test_one_frame_is_no_performance(shot: Shot) -> None:
    verdict = verdict_on(replace(shot, take=shot.take.with_frames(slice(0, 1))))
    assert verdict.level == "not_usable"
    assert codes(verdict) == ["PERFORMANCE_STILL", "PERFORMANCE_SHORT"]
    assert verdict.reasons[1].message.startswith("the take is too short for a performance: 1 frame")


def test_a_few_frames_are_too_short(shot: Shot) -> None:
    assert "PERFORMANCE_SHORT" in codes(
        verdict_on(replace(shot, take=shot.take.with_frames(slice(0, 3))))
    )


@pytest.mark.parametrize(
    ("frames", "rate", "short"), [(31, 60.0, True), (36, 60.0, False), (60, 240.0, True)]
)
def test_seconds_count_not_frames(frames: int, rate: float, short: bool) -> None:
    measured = performance_short(np.arange(frames) / rate)
    verdict = judge({"PERFORMANCE_SHORT": measured})
    assert (verdict.level == "look_at") is short
    assert measured.where == (f"{frames} frames, {(frames - 1) / rate:.2g} s",)


def test_markers_rest_that_move_less_than_a_thousandth_of_the_face() -> None:
    assert still_markers(0.0, 0.06).value == 1.0
    assert still_markers(3e-5, 0.06).value == pytest.approx(0.5)
    assert still_markers(1e-4, 0.06).value == 0.0
    assert np.isnan(still_markers(0.0, 0.0).value)


@pytest.mark.parametrize(("peak", "level"), [(0.0, "not_usable"), (0.3, "good")])
def test_weights_that_rest_are_no_performance(peak: float, level: str) -> None:
    weights = np.full((90, 2), 0.2)
    weights[40:50, 1] += peak
    take = WeightsTake(("jawOpen", "smile"), np.arange(90) / 60, weights, 60.0)
    assert judge({"PERFORMANCE_STILL": still_weights(take)}).level == level


@pytest.mark.parametrize(
    ("shapes", "curves", "share", "level"),
    [
        (("jawOpen", "browDown_L"), {}, 0.0, "good"),
        (("jawOpen",), {}, 0.6, "look_at"),
        (("browDownLeft",), {}, 0.8, "look_at"),
        (("Jaw", "Brow"), {"jawOpen": {"Jaw": 1.0}}, 0.6, "look_at"),
        (("jawOpen",), {"browDownLeft": {}}, 0.0, "good"),  # as a person wants it
    ],
)
def test_motion_that_moves_no_blend_shape(
    shapes: tuple[str, ...], curves: dict[str, dict[str, float]], share: float, level: str
) -> None:
    wave = np.sin(np.linspace(0, 2 * np.pi, 60, endpoint=False)) / 2 + 0.5
    names = ("jawOpen", "browDownLeft", "eyeLookInLeft")
    take = WeightsTake(names, np.arange(60) / 60, np.outer(wave, [0.8, 0.6, 1.0]), 60.0)
    setup = RetargetSetup(Binding((), np.array([], dtype=int)), curves=curves)
    measured = idle_curves(take, shapes, setup)
    assert measured.value == pytest.approx(share, abs=1e-12)
    assert judge({"CURVES_IDLE": measured}).level == level
    assert measured.kind == "curves" and "eyeLookInLeft" not in measured.where


@pytest.mark.parametrize(
    ("name", "peak"),
    [
        *((name, 1.0) for name in ("headYaw", "HeadPitch", "headroll", "HEADYAW", "head_roll")),
        *((name, 0.9) for name in ("eyeYaw", "leftEyeYaw", "RightEyePitch", "lefteyeroll")),
        ("turn", 30.0),  # degrees
    ],
)
def test_rotations_are_no_motion_of_the_face(name: str, peak: float) -> None:
    wave = np.sin(np.linspace(0, 2 * np.pi, 60, endpoint=False)) / 2 + 0.5
    names = ("jawOpen", "smile", name)
    setup = RetargetSetup(Binding((), np.array([], dtype=int)))
    for unit in (1.0, 100.0):  # weights as shares and in per cent
        peaks = unit * np.array([0.8, 0.6, peak])
        take = WeightsTake(names, np.arange(60) / 60, np.outer(wave, peaks), 60.0)
        measured = idle_curves(take, ("jawOpen",), setup)
        assert measured.value == pytest.approx(0.6) and measured.where == ("smile",)
