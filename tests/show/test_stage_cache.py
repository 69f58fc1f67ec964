"""The stages of a shot: exactly those run again that depend on a change, with the same bytes."""

import errno
import json
import shutil
from dataclasses import is_dataclass, replace
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest
from processed import digests
from worlds import make_world

from usdface.cleanup.clean import Cleaned
from usdface.expression_system import ExpressionSystem
from usdface.findings import Finding
from usdface.options import ProcessOptions
from usdface.pipeline import make_shot, process
from usdface.shot.retarget_pieces import EstimatedTake, SolvedPiece
from usdface.shot.shot import Shot, ShotResult, SolvedShot
from usdface.show import stage_cache

PACE = "double usdface:solve:pace = 8"
EASE = "uniform double usdface:ease = 0", "uniform double usdface:ease = 0.2"
WEIGHT = "float usdface:weight = 1", "float usdface:weight = 0.5"
SPIKES = "usdface:clean:spikes = 1", "usdface:clean:spikes = 0"
CALIBRATION = """uniform token[] usdface:calibration:shapes = ["jawOpen"]
uniform float[] usdface:calibration:gains = [1.2]
uniform float[] usdface:calibration:offsets = [0]"""
FILES = ("rig.usda", "take.usda", "shot.usda")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_world().write(tmp_path_factory.mktemp("cached"))
    make_shot(*(folder / name for name in FILES), bind=folder / "bind.json")
    process(folder / "shot.usda", cache=folder / "cache")
    return folder


@pytest.fixture
def place(made: Path, tmp_path: Path) -> Path:
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return tmp_path


def changed(file: Path, old: str, new: str) -> None:
    head, points, text = file.read_text().partition("point3f[] points")
    if not points:
        head, text = "", head
    assert old in text
    file.write_text(head + points + text.replace(old, new, 1))


def stages(place: Path, **options: object) -> str:
    """Process with the cache; return the stages that were computed, after a look at the bytes."""
    chosen = ProcessOptions(**options)  # type: ignore[arg-type]
    result = process(place / "shot.usda", cache=place / "cache", options=chosen)
    with_cache = digests(place / "shot.usdface")
    plain = process(place / "shot.usda", options=chosen)
    assert digests(place / "shot.usdface") == with_cache
    about_the_face = tuple(f for f in result.findings if f.code != "CACHE_NOT_KEPT")
    assert about_the_face == plain.findings and result.details == plain.details
    used = result.summary.pop("stages")
    assert result.summary == plain.summary
    return " ".join(name for name, how in used.items() if how == "computed")


def parts_of(kind: object, seen: set[type]) -> set[type]:
    """Return `seen` and the dataclasses that values of a type consist of, but for inputs."""
    for part in get_args(kind):
        parts_of(part, seen)
    known = {Shot, ExpressionSystem, *seen}
    if isinstance(kind, type) and is_dataclass(kind) and kind not in known:
        seen.add(kind)
        for hint in get_type_hints(kind).values():
            parts_of(hint, seen)
    return seen


def test_every_part_of_a_stage_can_be_read_again() -> None:
    """Else a stage would be written and computed in every run, as takes of one camera were."""
    roots = Cleaned | SolvedShot | ShotResult | EstimatedTake | SolvedPiece
    assert parts_of(roots, {Finding}) == set(stage_cache._CLASSES)


@pytest.mark.slow
def test_nothing_changed_nothing_computed(place: Path) -> None:
    assert stages(place) == ""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("take.usda", "0.0", "0.1"),
        pytest.param("rig.usda", "0.0", "0.1", marks=pytest.mark.slow),
        ("shot.usda", "usdface:neutral:range = (0, 3)", "usdface:neutral:range = (0, 2)"),
        pytest.param("shot.usda", PACE, PACE.replace("8", "9"), marks=pytest.mark.slow),
        ("shot.usda", PACE, f"{PACE}\nfloat usdface:pin:jawOpen.timeSamples = {{10: 0.5}}\n"),
        ("shot.usda", PACE, f"{PACE}\n{CALIBRATION}\n"),
    ],
)
def test_an_input_of_the_solve_computes_both(place: Path, name: str, old: str, new: str) -> None:
    changed(place / name, old, new)
    # A clean-up has not the rig, pins or calibration.
    again = "solve clean" if name == "take.usda" or "neutral" in old else "solve"
    assert stages(place) in (f"{again} express", again)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("float usdface:gain = 1", "float usdface:gain = 0.5"),
        pytest.param(*EASE, marks=pytest.mark.slow),
        pytest.param(*WEIGHT, marks=pytest.mark.slow),
        ("bool usdface:closure:lids = 1", "bool usdface:closure:lids = 0"),
        (PACE, f"{PACE}\nfloat usdface:exaggeration = 1.1\n"),
    ],
)
def test_an_input_of_the_correction_computes_that_alone(place: Path, old: str, new: str) -> None:
    changed(place / "shot.usda", old, new)
    assert stages(place) == "express"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "wanted"),
    [
        ({"express": False}, "express"),
        pytest.param({"closure": False}, "express", marks=pytest.mark.slow),
        pytest.param({"head": False}, "express", marks=pytest.mark.slow),
        ({"exaggeration": {"brows": 1.2}}, "express"),
        ({"clean": False}, "solve clean express"),
        ({"solve": "frame"}, "solve express"),
    ],
)
def test_options_compute_what_they_say(
    place: Path, options: dict[str, object], wanted: str
) -> None:
    assert stages(place, **options) == wanted


@pytest.mark.slow
def test_a_setting_that_goes_to_and_fro_costs_nothing_and_files_do_not_pile_up(place: Path) -> None:
    shot = (place / "shot.usda").read_text()
    for gain in (0.5, 0.6, 0.7):
        changed(place / "shot.usda", "float usdface:gain = 1", f"float usdface:gain = {gain}")
        assert stages(place) == "express"
        assert stages(place) == ""
        if gain == 0.5:
            (place / "shot.usda").write_text(shot)
            assert stages(place) == ""
        (place / "shot.usda").write_text(shot)
    assert len(list((place / "cache").iterdir())) == 4


def test_shots_of_one_take_and_face_share_a_solve(place: Path) -> None:
    shutil.copy(place / "shot.usda", place / "other.usda")
    changed(place / "other.usda", "float usdface:gain = 1", "float usdface:gain = 0.5")
    used = process(place / "other.usda", cache=place / "cache").summary["stages"]
    assert used == {"solve": "cached", "express": "computed"}


@pytest.mark.slow
def test_another_character_shares_the_cleaned_take_with_the_bytes_of_its_own_clean_up(
    tmp_path: Path,
) -> None:
    world = make_world()
    positions = world.take.positions.copy()
    positions[10:14, 3], positions[20, 5] = np.nan, positions[20, 5] + 0.03
    folder = replace(world, take=replace(world.take, positions=positions)).write(tmp_path)
    make_shot(*(folder / name for name in FILES), bind=folder / "bind.json")
    repaired = process(folder / "shot.usda", cache=folder / "cache").value.repairs
    assert {repair.kind for repair in repaired} == {"spike", "fill"}
    changed(folder / "rig.usda", "0.0", "0.1")
    assert stages(folder) in ("solve express", "solve")
    changed(folder / "take.usda", "0.0", "0.1")
    assert stages(folder).startswith("solve clean")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("usdface:clean:swaps = 1", "usdface:clean:swaps = 0"),
        pytest.param(*SPIKES, marks=pytest.mark.slow),
        ("usdface:clean:gaps = 1", "usdface:clean:gaps = 0"),
        ('usdface:head:mode = "solve"', 'usdface:head:mode = "stabilised"'),
    ],
)
def test_each_setting_of_the_clean_up_counts(place: Path, old: str, new: str) -> None:
    changed(place / "shot.usda", old, new)
    assert stages(place).startswith("solve clean")


@pytest.mark.slow
def test_another_character_shares_the_cleaned_take_of_markers_that_it_binds(place: Path) -> None:
    changed(place / "rig.usda", "0.0", "0.1")
    used = process(place / "shot.usda", cache=place / "cache").summary["stages"]
    assert used["clean"] == "cached" and used["solve"] == "computed"
    bind = json.loads((place / "bind.json").read_text())
    del bind["markers"]["cheek_l"]
    (place / "fewer.json").write_text(json.dumps(bind))
    files = (place / name for name in ("rig.usda", "take.usda", "fewer.usda"))
    make_shot(*files, bind=place / "fewer.json")
    used = process(place / "fewer.usda", cache=place / "cache").summary["stages"]
    assert used["clean"] == "computed"


@pytest.mark.slow
def test_damaged_files_are_computed_anew(place: Path) -> None:
    for file in (place / "cache").iterdir():
        data = bytearray(file.read_bytes())
        data[len(data) // 2] ^= 1
        file.write_bytes(data)
    assert stages(place) == "solve clean express"
    assert stages(place) == ""


@pytest.mark.slow
def test_another_program_computes_anew(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from usdface.show import stage_cache

    monkeypatch.setattr(stage_cache, "program", lambda: {"python": "4.0"})
    assert stages(place) == "solve clean express"


@pytest.mark.slow
def test_a_cache_that_cannot_be_written_is_none(place: Path) -> None:
    shutil.rmtree(place / "cache")
    (place / "cache").write_text("a file")
    assert stages(place) == "solve clean express"
    assert (place / "cache").read_text() == "a file"


def test_an_explanation_with_its_memberships_is_not_kept(place: Path) -> None:
    result = process(place / "shot.usda", cache=place / "cache", options=ProcessOptions(trace=True))
    assert result.summary["stages"] == {"solve": "cached"}
    assert result.value.trace is not None
    assert result.value.trace.sides["both"].evaluation.memberships


@pytest.mark.parametrize("blocked", ["a file", "a full disk"])
def test_a_stage_that_cannot_be_kept_is_announced(
    place: Path, monkeypatch: pytest.MonkeyPatch, blocked: str
) -> None:
    shutil.rmtree(place / "cache")
    if blocked == "a file":
        (place / "cache").write_text("")
    else:

        def full(*_: object) -> None:
            raise OSError(errno.ENOSPC, "No space left on device")

        monkeypatch.setattr(stage_cache, "write_packed", full)
    result = process(place / "shot.usda", cache=place / "cache")
    found = [f for f in result.findings if f.code == "CACHE_NOT_KEPT"]
    assert {f.where for f in found} == set(result.summary["stages"])
    reason = "Not a directory" if blocked == "a file" else "No space left"
    assert found and all(reason in f.message for f in found)
