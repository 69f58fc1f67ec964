"""Residuals of occluded markers: ends that meet, and a face that does not jump in a gap."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ict_face import ict_mesh

from usdface.io.bind_file import read_bind
from usdface.io.takes.files import read_take
from usdface.options import ProcessOptions
from usdface.retarget.occluded_residual import occluded_residual
from usdface.rigs import Rig
from usdface.shot.assembly import assemble_shot
from usdface.shot.retarget import retarget
from usdface.takes import MarkerTake

TIMES = np.arange(101) / 100.0
GAP = np.zeros((101, 2), dtype=bool)
GAP[30:61, 0] = True
MISFIT = {"noise": 0.0, "misfit": 1e-3}


def test_it_goes_from_one_end_of_a_gap_to_the_other() -> None:
    residual = np.where(GAP, np.nan, np.stack([1e-3 + 2e-3 * TIMES, TIMES], axis=1))
    found = occluded_residual(residual, GAP, TIMES, **MISFIT)
    assert not found[~GAP].any()
    # Nearly a straight line over 0.3 s.
    np.testing.assert_allclose(found[30:61, 0], 1e-3 + 2e-3 * TIMES[30:61], rtol=0.02)


def test_constant_residuals_last_the_less_the_longer_the_gap() -> None:
    residual = np.where(GAP, np.nan, 1.0)
    short = occluded_residual(residual, GAP, TIMES, **MISFIT)[45, 0]
    long = occluded_residual(residual, GAP, 20.0 * TIMES, **MISFIT)[45, 0]
    # The mean of an Ornstein-Uhlenbeck process halfway between two ends: 1 / cosh.
    assert short == pytest.approx(1.0 / np.cosh(0.16))
    assert long == pytest.approx(1.0 / np.cosh(3.2))


def test_beyond_the_last_frame_that_shows_a_marker_it_decays() -> None:
    hidden = np.zeros((101, 1), dtype=bool)
    hidden[50:] = True
    found = occluded_residual(np.where(hidden, np.nan, 1.0), hidden, TIMES, **MISFIT)
    np.testing.assert_allclose(found[50:, 0], np.exp(49 / 100.0 - TIMES[50:]))


def test_the_mean_of_noise_is_carried() -> None:
    noise = np.random.default_rng(3).normal(size=(101, 1))
    hidden = GAP[:, :1]
    found = occluded_residual(np.where(hidden, np.nan, noise), hidden, TIMES, noise=1.0, misfit=0)
    before, after = noise[10:30].mean(), noise[61:81].mean()
    np.testing.assert_allclose(found[45], (before + after) / 2 / np.cosh(0.16), rtol=1e-9)
    constant = np.where(GAP, np.nan, 1.0)
    np.testing.assert_allclose(
        occluded_residual(constant, GAP, TIMES, noise=1.0, misfit=0.0),
        occluded_residual(constant, GAP, TIMES, **MISFIT),
    )


def test_nothing_is_carried_of_a_marker_that_is_never_shown() -> None:
    never = np.ones((101, 2), dtype=bool)
    assert not occluded_residual(np.zeros((101, 2)), never, TIMES, **MISFIT).any()


@pytest.mark.slow
@pytest.mark.parametrize("frames", [5, 30])
@pytest.mark.parametrize("parts", [("Mouth", "Chin", "cheek"), ("",)])
def test_an_open_jaw_stays_open_while_its_markers_are_occluded(
    shared_data: Path, parts: tuple[str, ...], frames: int
) -> None:
    """AnimFace's jaw is wide open in frames 397 to 460; the largest marker's step was 9 mm."""
    take, _ = read_take(shared_data / "animface" / "Jaw.c3d")
    assert isinstance(take, MarkerTake)
    bind, _ = read_bind(Path(__file__).parents[1] / "data" / "animface_ict_bind.json")
    mesh = ict_mesh(shared_data)
    hidden = [i for i, name in enumerate(take.names) if any(part in name for part in parts)]
    positions = take.positions.copy()
    positions[400 : 400 + frames, hidden] = np.nan
    shot, _ = assemble_shot(Rig("Face", (mesh,)), replace(take, positions=positions), setup=bind)
    solved = retarget(shot, options=ProcessOptions(express=False, closure=False)).solved
    names = [solved.names.index(name) for name in mesh.shape_names]
    near = solved.weights[395 : 405 + frames, names]
    moved = np.einsum("fs,smd->fmd", near, mesh.offsets_at(np.array(bind.binding.points)))
    assert near[:, mesh.shape_names.index("jawOpen")].min() > 0.95
    assert np.linalg.norm(np.diff(moved, axis=0), axis=2).max() < 0.0005
