"""Shots without a binding, or with a part of one, through the command line."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worlds import World, make_world

from usdface.cli import main
from usdface.io.usd.shot import read_shot
from usdface.io.usd.stage import open_stage
from usdface.io.usd.take import read_take_prim
from usdface.io.usd.take_write import write_take
from usdface.takes import MarkerTake


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


@pytest.fixture
def folder(world: World, tmp_path: Path) -> Path:
    return world.write(tmp_path / "scene")


def shot(folder: Path, *options: object) -> int:
    files = ["--rig", folder / "rig.usda", "--take", folder / "take.usda"]
    return main([str(a) for a in ["shot", *files, "-o", folder / "shot.usda", *options]])


def written(folder: Path, *options: object) -> tuple[dict, dict]:
    """Make a shot; return the binding and the report that it writes."""
    bind, report = folder / "made.json", folder / "report.json"
    assert shot(folder, "--write-bind", bind, "--report", report, *options) == 0
    return json.loads(bind.read_text()), json.loads(report.read_text())


def codes(report: dict) -> set[str]:
    return {finding["code"] for finding in report["findings"]}


@pytest.mark.slow
def test_without_a_binding_one_is_proposed_and_the_shot_can_be_processed(
    folder: Path, world: World
) -> None:
    bind, report = written(folder)
    assert {name: place["point"] for name, place in bind["markers"].items()} == world.points
    assert all(0 < place["confidence"] <= 1 for place in bind["markers"].values())
    assert bind["head"] == "solve" and bind["nose_tip"] == "nose"
    assert {"BIND_PROPOSED", "NEUTRAL_FOUND"} <= codes(report)
    summary = report["summary"]
    assert summary["markers_bound"] == len(world.points) and summary["confidence_min"] > 0.5
    assert summary["neutral_frames"] == [0, bind["neutral"]["end"]]
    assert main(["process", str(folder / "shot.usda")]) == 0
    # The binding that was written makes the same shot.
    first = (folder / "shot.usda").read_bytes()
    assert shot(folder, "--bind", folder / "made.json") == 0
    assert (folder / "shot.usda").read_bytes() == first


def test_a_partial_binding_is_completed_only_when_asked(folder: Path, world: World) -> None:
    some = dict(list(world.bind["markers"].items())[:6])
    (folder / "some.json").write_text(json.dumps(world.bind | {"markers": some}))
    bind, report = written(folder, "--bind", folder / "some.json")
    assert set(bind["markers"]) == set(some) and "BIND_PROPOSED" not in codes(report)
    unbound = len(world.points) - len(some)
    (found,) = (f for f in report["findings"] if f["code"] == "MARKER_UNBOUND")
    values = found["values"]
    assert (values["unbound_count"], values["marker_count"]) == (unbound, len(world.points))
    assert sorted(values["markers"]) == sorted(set(world.points) - set(some))
    bind, report = written(folder, "--bind", folder / "some.json", "--propose")
    assert {name: place["point"] for name, place in bind["markers"].items()} == world.points
    assert [bind["markers"][name]["confidence"] for name in some] == [1.0] * 6
    # The neutral that the file names is kept.
    assert "NEUTRAL_FOUND" not in codes(report) and bind["neutral"] == world.bind["neutral"]


def test_a_marker_that_the_take_lacks_is_said_at_the_shot(folder: Path) -> None:
    bind = json.loads((folder / "bind.json").read_text())
    bind["markers"]["chni"] = {"point": 0}
    (folder / "typo.json").write_text(json.dumps(bind))
    for more in ((), ("--propose",)):
        _, report = written(folder, "--bind", folder / "typo.json", *more)
        (reported,) = (f for f in report["findings"] if f["code"] == "MARKER_UNKNOWN")
        assert reported["where"] == f"{folder / 'typo.json'}: chni"
        assert reported["values"] == {"marker": "chni"}


def test_a_misspelt_marker_is_not_counted_as_bound_and_the_one_meant_is_named(
    folder: Path, world: World, capsys: pytest.CaptureFixture[str]
) -> None:
    bind = json.loads((folder / "bind.json").read_text())
    bind["markers"]["chni"] = bind["markers"].pop("chin")
    typo = folder / "typo.json"
    typo.write_text(json.dumps(bind))
    assert shot(folder, "--bind", typo) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert f"markers bound {len(world.points) - 1} " in printed
    assert f"the take has no marker 'chni'; did you mean chin? ({typo}: chni)" in printed
    assert f"1 of {len(world.points)} markers are bound to no vertex: chin; --propose" in printed


def test_neutral_frames_can_be_named_or_looked_for(folder: Path) -> None:
    given = ("--bind", folder / "bind.json", "--neutral")
    assert written(folder, *given, 1, 2)[0]["neutral"] == {"start": 1, "end": 2}
    assert written(folder, *given, 3)[0]["neutral"] == {"start": 3, "end": 3}
    bind, report = written(folder, *given, "auto")
    assert bind["neutral"]["start"] == 0 and "NEUTRAL_FOUND" in codes(report)


def test_neutral_frames_of_another_take_do_not_count_where_they_are_looked_for(
    folder: Path, world: World, capsys: pytest.CaptureFixture[str]
) -> None:
    later = folder / "later.json"
    later.write_text(json.dumps(world.bind | {"neutral": {"start": 10**6, "end": 10**6}}))
    found = written(folder, "--bind", later, "--neutral", "auto")[0]
    own = written(folder, "--bind", folder / "bind.json", "--neutral", "auto")[0]
    assert found["neutral"] == own["neutral"]
    assert shot(folder, "--bind", later) == 1
    assert "lie outside the take" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("until", [27, None])
def test_swapped_labels_are_put_right_before_frames_and_places_are_looked_for(
    folder: Path, world: World, until: int | None
) -> None:
    """For a third of the take, or to its end, two labels are exchanged after the neutral."""
    right, _ = written(folder, "--neutral", "auto")
    swapped = world.take.positions.copy()
    some = slice(13, until)
    swapped[some, [1, 12]] = world.take.positions[some, [12, 1]]
    write_take(replace(world.take, positions=swapped), folder / "take.usda")
    found, _ = written(folder, "--neutral", "auto")
    assert found["markers"] == right["markers"] and found["neutral"] == right["neutral"]


@pytest.mark.slow
def test_a_marker_that_is_far_off_for_a_while_moves_neither_frames_nor_places(
    folder: Path, world: World
) -> None:
    right, _ = written(folder)
    away = world.take.positions.copy()
    away[len(away) // 2 : 3 * len(away) // 5, 1] += (0.6, 0.4, 0.0)
    write_take(replace(world.take, positions=away), folder / "take.usda")
    found, _ = written(folder)
    assert found["neutral"] == right["neutral"]
    assert [each["point"] for each in found["markers"].values()] == [
        each["point"] for each in right["markers"].values()
    ]


def test_weights_of_the_neutral_reach_the_shot(folder: Path, world: World) -> None:
    weights = {world.rig.meshes[0].shape_names[0]: 0.125}
    neutral = {"start": 0, "end": 3, "weights": weights}
    (folder / "rest.json").write_text(json.dumps(world.bind | {"neutral": neutral}))
    assert written(folder, "--bind", folder / "rest.json")[0]["neutral"] == neutral
    read, _ = read_shot(open_stage(folder / "shot.usda"), "shot")
    assert dict(read.shot.setup.neutral_weights) == weights
    # Frames that are named instead show nothing but what is said of them.
    bind, _ = written(folder, "--bind", folder / "rest.json", "--neutral", 1, 2)
    assert bind["neutral"] == {"start": 1, "end": 2}


def test_peak_frames_can_be_named_or_looked_for(folder: Path, world: World) -> None:
    given = ("--bind", folder / "bind.json")
    assert written(folder, *given)[0]["peaks"] == []
    assert written(folder, *given, "--peaks", 30, 12)[0]["peaks"] == [30, 12]
    bind, report = written(folder, *given, "--peaks", "auto")
    frames = bind["peaks"]
    assert len(frames) > 4 and report["summary"]["peak_frames"] == frames
    # The farthest from neutral comes first.
    away = np.linalg.norm(world.weights, axis=1)
    assert away[frames[0]] > 0.7 * away.max()


@pytest.mark.slow
def test_places_are_proposed_by_the_peak_frames_that_are_named(folder: Path, world: World) -> None:
    some = dict(list(world.bind["markers"].items())[:6])
    (folder / "some.json").write_text(json.dumps(world.bind | {"markers": some, "peaks": [35, 20]}))
    options = ("--bind", folder / "some.json", "--propose")
    named, _ = written(folder, *options)
    assert named["peaks"] == [35, 20]
    found, _ = written(folder, *options, "--peaks", "auto")
    assert found["peaks"] != [35, 20] and len(found["peaks"]) > 4
    sure = [sum(p["confidence"] for p in bind["markers"].values()) for bind in (named, found)]
    assert sure[0] != sure[1]


def test_the_shot_says_how_sure_each_place_is(folder: Path) -> None:
    given = folder / "given.json"
    document = json.loads((folder / "bind.json").read_text())
    first, second, *_ = document["markers"].values()
    first["confidence"], second["confidence"] = 0.25, 1
    given.write_text(json.dumps(document | {"peaks": [7]}))
    assert shot(folder, "--bind", given) == 0
    read = read_shot(open_stage(folder / "shot.usda"), "shot")[0].shot.setup
    assert read.binding.confidence is not None
    np.testing.assert_array_equal(read.binding.confidence[:2], [0.25, 1.0])
    assert np.isnan(read.binding.confidence[2:]).all() and read.peaks == (7,)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--peaks", "5", "-2"], "--peaks"),
        (["--peaks", "5", "400"], "the peak frame 400 lies outside the take"),
        (["--neutral", "5", "2"], "neutral frames 5 to 2"),
        (["--neutral", "first"], "--neutral is 'first'"),
        (["--neutral", "0", "400"], "outside the take"),
        (["--write-bind", "take.usda"], "overwritten"),
        (["--bind-figure", "face.txt"], "no picture"),
    ],
)
def test_wrong_options_are_one_line(
    folder: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    options: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(folder)
    before = (folder / "take.usda").read_bytes()
    assert shot(folder, "--bind", folder / "bind.json", *options) == 1
    error = capfd.readouterr().err
    assert message in error and error.count("\n") == 1
    assert (folder / "take.usda").read_bytes() == before


@pytest.fixture
def senseless(world: World, folder: Path) -> Path:
    """A take whose markers fit no face."""
    rng = np.random.default_rng(0)
    rest, swing = 0.1 * rng.normal(size=(20, 3)), 0.01 * rng.normal(size=(3, 20, 3))
    curves = rng.normal(size=(40, 3)).cumsum(axis=0)
    positions = rest + np.einsum("fk,kmd->fmd", curves, swing)
    names = tuple(f"m{i}" for i in range(20))
    write_take(MarkerTake(names, np.arange(40) / 30, positions, 30.0), folder / "take.usda")
    return folder


@pytest.mark.slow
def test_a_shot_of_mostly_unsure_places_is_refused_and_the_proposal_written(
    senseless: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bind = senseless / "made.json"
    assert shot(senseless, "--write-bind", bind, "--print-bind") != 0
    assert not (senseless / "shot.usda").exists()
    printed = capsys.readouterr()
    said = [line for line in printed.err.splitlines() if line != f"wrote {bind}"]
    assert len(said) < 3 and "--bind" in printed.err
    assert f"wrote {bind}\n" in printed.err and "page of `usdface bind`" in printed.err
    assert "0 of 20 are sure" in printed.err
    document = json.loads(bind.read_text())
    assert json.loads(printed.out) == document
    assert len(document["unsure"]) > len(document["markers"])
    assert all(place["confidence"] < 0.5 for place in document["unsure"].values())


def test_markers_of_two_performers_are_named_as_why_places_are_unsure(
    senseless: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stage = open_stage(senseless / "take.usda")
    take, _ = read_take_prim(stage.GetDefaultPrim())
    names = tuple(f"{'AB'[i % 2]}:m{i // 2}" for i in range(20))
    write_take(replace(take, names=names), senseless / "two.usda")
    assert shot(senseless, "--take", senseless / "two.usda") == 1
    assert "several performers, A, B: export those of one" in capsys.readouterr().err


def test_vertices_without_the_name_of_their_mesh_are_those_of_the_face(
    tmp_path: Path, world: World
) -> None:
    """As a binding that is written by hand, or one without any vertex, on a head with eyes."""
    (mesh,) = world.rig.meshes
    eye = replace(mesh, name="eye", shapes=mesh.shapes[:1], points=0.1 * mesh.points)
    folder = replace(world, rig=replace(world.rig, meshes=(eye, mesh))).write(tmp_path / "scene")
    document = json.loads((folder / "bind.json").read_text())
    document.pop("mesh", None)
    (folder / "bind.json").write_text(json.dumps(document))
    bind, report = written(folder, "--bind", folder / "bind.json")
    assert bind["mesh"].endswith("/head")
    (found,) = [each for each in report["findings"] if each["code"] == "MESH_ASSUMED"]
    assert found["values"]["mesh"] == bind["mesh"] and found["where"].endswith("bind.json")
    (folder / "none.json").write_text('{"markers": {}}')
    bind, report = written(folder, "--bind", folder / "none.json", "--propose")
    assert bind["mesh"].endswith("/head") and "MESH_ASSUMED" not in codes(report)
