"""What stands in a C3D file beside its points is named."""

from pathlib import Path

import numpy as np
import pytest

from usdface.io.takes.c3d_ignored import report_beside_points

PATH = Path("a.c3d")


def named(held: int = 0, **parameters: list[float] | list[str]) -> list[list[str]]:
    """Return the channels that findings name; `GROUP_NAME` is a parameter."""
    given = {
        key.replace("_", ":", 1): v if isinstance(v[0], str) else np.array(v, np.float64)
        for key, v in parameters.items()
    }
    found = report_beside_points(PATH, given, held)
    assert {f.code for f in found} <= {"CHANNEL_IGNORED"}
    return [list(f.values["channels"]) for f in found]


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        ({}, ["12 without a name"]),
        ({"ANALOG_USED": [3.0], "ANALOG_LABELS": ["Fx", "", "Fz", "spare"]}, ["Fx", "Fz"]),
        ({"ANALOG_USED": [2.0], "ANALOG_LABELS": ["a"], "ANALOG_LABELS2": ["b"]}, ["a", "b"]),
    ],
)
def test_analog_channels(parameters: dict, expected: list[str]) -> None:
    lost = parameters.get("ANALOG_USED", [0])[0] - len(expected)
    assert named(12, **parameters) == [expected + (["1 without a name"] if lost == 1 else [])]
    assert named(0, **parameters) == []


def test_rotations_and_events() -> None:
    assert named(ROTATION_USED=[2.0], ROTATION_LABELS=["head_4X4"]) == [
        ["head_4X4", "1 without a name"]
    ]
    assert named(EVENT_USED=[1.0], EVENT_LABELS=["Clap"]) == [["Clap"]]
    assert named(EVENT_USED=[0.0], EVENT_LABELS=["Clap"], ROTATION_USED=[0.0]) == []
    late = [20.0, 34.5]  # minutes and seconds
    assert named(EVENT_USED=[1.0], EVENT_LABELS=["Clap"], EVENT_TIMES=late) == [
        ["Clap at 1234.50 s"]
    ]


@pytest.mark.parametrize("used", [-1.0, float("nan"), float("inf"), 1e9])
def test_a_number_of_entries_that_is_none_counts_as_none(used: float) -> None:
    assert named(EVENT_USED=[used], EVENT_LABELS=["Clap"], ROTATION_USED=[used]) == []
    assert named(4, ANALOG_USED=[used], ANALOG_LABELS=["Fx"]) == [["4 without a name"]]
