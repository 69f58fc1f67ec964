from dataclasses import replace

import numpy as np
import pytest
from worlds import make_world

from usdface.figures.peak_frames import peak_frames, sheet_frames
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot.shot import Shot, ShotResult
from usdface.takes import WeightsTake

RATE = 30.0
FRAMES = 240


@pytest.fixture(scope="module")
def result() -> ShotResult:
    """A jaw that opens at frame 60, brows that go up at 150, and a correction at 200."""
    world = make_world(head_moves=False)
    names = world.rig.shape_names
    weights = np.zeros((FRAMES, len(names)))
    frames = np.arange(FRAMES)

    def bump(middle: int) -> np.ndarray:
        return np.exp(-0.5 * ((frames - middle) / 5) ** 2)

    weights[:, names.index("jawOpen")] = bump(60)
    brow = next(i for i, name in enumerate(names) if name.startswith("brow"))
    weights[:, brow] = bump(150)
    take = WeightsTake(names, frames / RATE, weights, RATE)
    nothing = RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)))
    corrected = weights.copy()
    corrected[:, names.index("jawOpen")] += 0.5 * bump(200)
    return ShotResult(Shot(world.rig, take, nothing), take, corrected=corrected)


def test_peaks_corrections_and_rest_are_found(result: ShotResult) -> None:
    found = peak_frames(result)
    assert "rest" in found.values()
    assert list(found) == sorted(found)
    for frame in (60, 150, 200):
        assert min(abs(frame - other) for other in found) <= 1, frame
    assert found[min(found, key=lambda frame: abs(frame - 200))] == "correction"


def test_frames_are_apart(result: ShotResult) -> None:
    frames = np.array([frame for frame, why in peak_frames(result).items() if why != "rest"])
    assert np.diff(frames).min() / RATE >= 0.4 - 1e-9


def test_a_peak_near_rest_is_drawn_itself(result: ShotResult) -> None:
    weights = result.solved.weights.copy()
    weights[weights.max(axis=1) < 0.2] += 1e-4
    weights[50] = 0.0
    near = replace(result, solved=replace(result.solved, weights=weights), corrected=None)
    found = peak_frames(near)
    assert found[50] == "rest"
    assert any(abs(frame - 60) <= 1 for frame in found)


def test_a_pose_that_is_held_is_found_at_its_middle(result: ShotResult) -> None:
    weights = np.zeros_like(result.solved.weights)
    away = np.abs(np.arange(FRAMES) - 60)
    weights[:, result.solved.names.index("jawOpen")] = np.clip((30 - away) / 10, 0, 1)
    solved = replace(result.solved, weights=weights)
    found = peak_frames(replace(result, solved=solved, corrected=None))
    assert [frame for frame, why in found.items() if "held" in why] == [60]
    brief = replace(solved, times=solved.times / 4)
    found = peak_frames(replace(result, solved=brief, corrected=None))
    assert "held" not in ", ".join(found.values())


def test_a_short_sheet_has_one_frame_of_each_kind_before_a_second(result: ShotResult) -> None:
    few = sheet_frames(result, 3)
    assert len(few) == 3 and list(few) == sorted(few)
    assert len(set(few.values())) == 3


def test_a_still_take_is_one_frame(result: ShotResult) -> None:
    still = replace(result.solved, weights=np.zeros_like(result.solved.weights))
    alone = replace(result, solved=still, corrected=None)
    assert set(sheet_frames(alone, 12).values()) == {"rest"}


def test_a_single_frame_is_drawn_for_all_that_it_shows(result: ShotResult) -> None:
    frame = replace(result.solved, times=np.zeros(1), weights=result.solved.weights[60:61])
    corrected = frame.weights + 0.5 * (frame.weights > 0.5)
    shot = replace(result.shot, take=frame)
    found = peak_frames(ShotResult(shot, frame, corrected=corrected))
    assert list(found) == [0] and {"correction", "mouth"} <= set(found[0].split(", "))
