"""The travel ratio of worlds whose motion is known."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worlds import World, camera_pixels, make_world

import usdface
from usdface import ProcessOptions, Shot
from usdface.cli import main
from usdface.face.regions import gain_region
from usdface.findings import Finding
from usdface.io.bind_file import setup_of_json
from usdface.retarget.travel import Travel, region_travel
from usdface.shot.report import ShotReport, report_of
from usdface.takes import MarkerTake


def shot_of(world: World) -> Shot:
    return usdface.assemble_shot(
        world.rig, world.take, setup=setup_of_json(world.bind, "bind.json")
    )[0]


def travels(
    shot: Shot, factor: float = 1.0, region_of: Callable[[str], str] = str
) -> dict[str, Travel]:
    result = usdface.retarget(shot, options=ProcessOptions(express=False, clean=False))
    assert result.solution is not None and isinstance(result.shot.take, MarkerTake)
    weights = factor * result.solution.weights.weights
    return region_travel(shot.face, result.shot.take, result.solution, weights, region_of)[0]


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


@pytest.fixture(scope="module")
def shot(world: World) -> Shot:
    return shot_of(world)


@pytest.mark.parametrize("factor", [1.0, 0.6, 1.3])
def test_an_exact_face_travels_as_far_as_its_weights_are_scaled(shot: Shot, factor: float) -> None:
    found = travels(shot, factor)
    assert {"brows", "eyes", "mouth"} <= set(found)
    for travel in found.values():
        assert travel.ratio == pytest.approx(factor, abs=0.005)
        assert travel.map_ratio == pytest.approx(1.0, abs=0.005)
        assert travel.correlation == pytest.approx(1.0, abs=0.005)
        assert travel.best_factor == pytest.approx(1.0 / factor, rel=0.01)
        assert travel.peak > 0.0015


def test_the_size_and_the_stance_of_the_performer_do_not_count(world: World, shot: Shot) -> None:
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    larger = 1.25 * world.take.positions @ turn + [0.3, 1.2, -0.4]
    other = replace(shot, take=replace(world.take, positions=larger))
    for region, travel in travels(other).items():
        assert travel.ratio == pytest.approx(1.0, abs=0.005), region


@pytest.mark.slow
def test_noise_does_not_look_like_a_muted_performance(world: World) -> None:
    """The weights are the true ones, so that only the measure sees the noise."""
    rng = np.random.default_rng(3)
    repeats = 12
    still = np.tile(make_world(head_moves=False).take.positions, (repeats, 1, 1))
    take = MarkerTake(
        world.take.names,
        np.arange(len(still)) / 30.0,
        still + 0.0006 * rng.normal(size=still.shape),
        30.0,
    )
    noisy = shot_of(replace(world, take=take))
    noisy = replace(noisy, setup=replace(noisy.setup, head="stabilised"))
    result = usdface.retarget(noisy, options=ProcessOptions(express=False, clean=False))
    assert result.solution is not None
    assert result.solution.noise == pytest.approx(0.0006, rel=0.2)
    true = np.tile(world.weights, (repeats, 1))
    for region, travel in region_travel(noisy.face, take, result.solution, true, str)[0].items():
        assert travel.ratio == pytest.approx(1.0, abs=0.04), region


@pytest.mark.slow
def test_a_region_at_rest_is_not_determined(world: World) -> None:
    brows = np.array([name.startswith("brow") for name in world.rig.shape_names])
    mesh, at = world.rig.meshes[0], np.array(list(world.points.values()))
    rng = np.random.default_rng(4)
    moved = np.einsum("fs,smd->fmd", world.weights * brows, mesh.offsets_at(at))
    positions = mesh.points[at] + moved + 1e-4 * rng.normal(size=moved.shape)
    found = travels(shot_of(replace(world, take=replace(world.take, positions=positions))))
    assert found["brows"].ratio == pytest.approx(1.0, abs=0.1)
    assert np.isnan([found["mouth"].ratio, found["mouth"].correlation]).all()
    assert found["mouth"].peak < 0.001


def test_frames_in_which_a_marker_is_hidden_do_not_count(world: World, shot: Shot) -> None:
    positions = world.take.positions.copy()
    corner = world.take.names.index("corner_l")
    positions[8:30, corner] = np.nan
    hidden = replace(shot, take=replace(world.take, positions=positions))
    found = travels(hidden)
    assert {"brows", "eyes", "mouth"} <= set(found)
    for travel in found.values():
        assert travel.ratio == pytest.approx(1.0, abs=0.03)


def test_skin_that_no_blend_shape_moves_does_not_count(world: World, shot: Shot) -> None:
    """The forehead of a character need not move; the brows below it are not muted for that."""
    mesh = world.rig.meshes[0]
    vertex = world.points["forehead"]
    stiff = tuple(
        replace(s, indices=s.indices[keep], offsets=s.offsets[keep])
        for s in mesh.shapes
        for keep in [s.indices != vertex]
    )
    rig = replace(world.rig, meshes=(replace(mesh, shapes=stiff),))
    before, after = travels(shot), travels(shot_of(replace(world, rig=rig)))
    assert sum(t.markers for t in after.values()) == sum(t.markers for t in before.values()) - 1


@pytest.mark.slow
def test_an_image_has_two_axes(world: World, shot: Shot) -> None:
    flat = shot_of(replace(world, take=camera_pixels(make_world(head_moves=False).take)))
    found = travels(flat)
    assert {"brows", "mouth"} <= set(found)
    for region, travel in found.items():
        assert travel.ratio == pytest.approx(1.0, abs=0.05), region


def test_regions_merge_into_those_of_the_gains(shot: Shot) -> None:
    single, merged = travels(shot), travels(shot, region_of=gain_region)
    assert set(merged) <= {"brows", "eyes", "mouth"}
    assert sum(t.markers for t in merged.values()) == sum(t.markers for t in single.values())


def played(shot: Shot, exaggeration: dict[str, float], **shrunk: float) -> ShotReport:
    """Report a shot that is played at a size, its weights of some shapes less than that."""
    options = ProcessOptions(express=False, closure=False, exaggeration=exaggeration)
    result = usdface.retarget(shot, options=options)
    weights = result.solved.weights.copy()
    for name, factor in shrunk.items():
        weights[:, [each.startswith(name) for each in result.solved.names]] *= factor
    return report_of(replace(result, solved=replace(result.solved, weights=weights)))


def muted(report: ShotReport) -> list[Finding]:
    return [found for found in report.findings if found.code == "REGION_MUTED"]


def test_a_muted_region_is_reported_with_the_factor_that_makes_up_for_it(shot: Shot) -> None:
    report = played(shot, {}, brow=0.6)
    assert report.summary["travel_ratio_by_region"]["brows"] == pytest.approx(0.6, abs=0.01)
    assert report.details["travel"]["brows"]["ratio"] == pytest.approx(0.6, abs=0.01)
    (found,) = muted(report)
    assert found.where == "brows" and "--exaggeration brows=1.7 " in found.message
    assert "asked_ratio" not in found.values


def test_a_factor_is_advised_only_if_the_option_takes_it(shot: Shot) -> None:
    (far,) = muted(played(shot, {}, brow=0.12))
    assert far.values["best_factor"] == pytest.approx(1 / 0.12, abs=0.3)
    assert "would do, beyond the 4 of --exaggeration: check the places" in far.message
    (half,) = muted(played(shot, {}, brow=0.4))
    assert "only --exaggeration brows=2.5 would do: check the places" in half.message
    (raised,) = muted(played(shot, {"brows": 4.0}, brow=0.1))
    assert "brows=" not in raised.message and "check the places" in raised.message


def test_a_size_that_was_asked_for_is_no_finding(tmp_path: Path, shot: Shot) -> None:
    for asked in ({"face": 0.6}, {"mouth": 0.6}, {"face": 0.4}, {"face": 0.5, "brows": 0.8}):
        report = played(shot, asked)
        assert not muted(report) and report.verdict is not None
        reasons = {reason.criterion.code for reason in report.verdict.reasons}
        assert "REGION_FLAT" not in reasons, asked
    folder = make_world().write(tmp_path, exaggeration={"brows": 0.6})
    files = (folder / "rig.usda", folder / "take.usda", folder / "shot.usda")
    usdface.make_shot(*files, bind=folder / "bind.json")
    report = tmp_path / "report.json"
    assert main(["process", str(folder / "shot.usda"), "--report", str(report)]) == 0
    written = json.loads(report.read_text())
    assert written["travel"]["brows"]["ratio"] == pytest.approx(0.6, abs=0.01)
    assert "REGION_MUTED" not in {found["code"] for found in written["findings"]}


@pytest.mark.parametrize(
    ("asked", "advice"),
    [
        ({"face": 0.6}, "--exaggeration 0.6,brows=1.7 "),
        ({"brows": 0.6}, "--exaggeration brows=1.0 "),
        ({"face": 0.5, "brows": 0.8}, "--exaggeration 0.5,brows=1.3 "),
    ],
)
def test_what_is_muted_beyond_the_size_asked_for_is_reported_with_both_factors(
    shot: Shot, asked: dict[str, float], advice: str
) -> None:
    size = float(np.prod(list(asked.values())))
    (found,) = muted(played(shot, asked, brow=0.6))
    assert found.where == "brows" and advice in found.message
    assert found.values["asked_ratio"] == pytest.approx(size)
    assert found.values["travel_ratio"] == pytest.approx(0.6 * size, abs=0.01)


def test_a_region_that_is_held_still_is_not_reported(shot: Shot) -> None:
    report = played(shot, {"face": 0.0})
    assert not muted(report) and report.verdict is not None
    assert "REGION_FLAT" not in {reason.criterion.code for reason in report.verdict.reasons}


def test_a_pin_in_a_region_that_is_held_still_is_not_reported(shot: Shot) -> None:
    """It may move the skin against the markers."""
    moved = usdface.retarget(shot, options=ProcessOptions(express=False)).solved.weights
    still = ProcessOptions(express=False, closure=False, exaggeration={"face": 0.0})
    result = usdface.retarget(shot, options=still)
    pinned = replace(result, solved=replace(result.solved, weights=0.1 * (1.0 - moved)))
    report = report_of(pinned)
    assert min(t["ratio"] for t in report.details["travel"].values() if t["ratio"]) < 0.0
    assert not muted(report)


def test_a_face_that_does_not_follow_is_not_to_be_exaggerated(shot: Shot) -> None:
    result = usdface.retarget(shot, options=ProcessOptions(express=False))
    shuffled = np.random.default_rng(5).permutation(result.solved.weights)
    lost = replace(result, solved=replace(result.solved, weights=shuffled))
    messages = [f.message for f in report_of(lost).findings if f.code == "REGION_MUTED"]
    assert messages and all("check the places" in message for message in messages)
    assert any("no factor brings it nearer: check" in message for message in messages)
