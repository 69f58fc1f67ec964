import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worlds import animation_of, make_world

from usdface.cli import main
from usdface.pipeline import calibrate, make_shot, process

STRENGTH = 1.2


@pytest.fixture(scope="module")
def face(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the files of a performer who moves a fifth more than the character, at full range."""
    world = make_world(head_moves=False)
    # Slowly, so that every extreme is held for a tenth of a second.
    weights = np.repeat(world.weights / world.weights.max(axis=0), 4, axis=0)
    rest = world.take.positions[0]
    at = np.array(list(world.points.values()))
    moved = np.einsum("fs,smd->fmd", weights, world.rig.face().offsets_at(at))
    times = np.arange(len(weights)) / world.take.rate
    take = replace(world.take, times=times, positions=rest + STRENGTH * moved)
    folder = replace(world, take=take).write(tmp_path_factory.mktemp("face"))
    np.save(folder / "truth.npy", weights)
    make_shot(
        folder / "rig.usda", folder / "take.usda", folder / "s.usda", bind=folder / "bind.json"
    )
    return folder


@pytest.mark.slow
def test_a_calibrated_shot_gives_the_character_its_own_range(face: Path) -> None:
    before = {path: hashlib.sha256(path.read_bytes()).digest() for path in face.iterdir()}
    out = face / "who.json"
    assert main(["calibrate", str(face / "s.usda"), "--extremes", "-o", str(out)]) == 0
    found = json.loads(out.read_text())["shapes"]
    assert all(entry["gain"] == pytest.approx(STRENGTH, abs=0.06) for entry in found.values())
    again, plain = face / "again.usda", face / "plain.usda"
    bind = face / "bind.json"
    own = face / "own.json"
    own.write_text(json.dumps(json.loads(bind.read_text()) | {"solve": {"gains": "given"}}))
    make_shot(face / "rig.usda", face / "take.usda", again, bind=bind, calibration=out)
    make_shot(face / "rig.usda", face / "take.usda", plain, bind=own)
    for shot in (again, plain, face / "s.usda"):
        process(shot)
    assert all(hashlib.sha256(p.read_bytes()).digest() == was for p, was in before.items())
    truth = np.load(face / "truth.npy")

    def error(shot: str) -> float:
        solved = animation_of(face / f"{shot}.usdface.usda", muted="express.usdc")
        return float(np.sqrt(np.mean((solved.weights - truth) ** 2)))

    assert error("again") < 0.5 * error("plain")
    assert error("s") < 0.5 * error(
        "plain"
    )  # what goes beyond the character's the take itself tells


@pytest.mark.slow
def test_the_same_take_gives_the_same_bytes(face: Path) -> None:
    one, two = face / "one.json", face / "two.json"
    calibrate(face / "s.usda", one)
    calibrate(face / "s.usda", two)
    assert one.read_bytes() == two.read_bytes()


def test_a_shape_the_rig_does_not_have_is_named(face: Path) -> None:
    who = face / "stranger.json"
    who.write_text('{"shapes": {"noseTwitch": {"gain": 1.5}}}')
    files = [face / "rig.usda", face / "take.usda", face / "x.usda"]
    result = make_shot(*files, bind=face / "bind.json", calibration=who)
    assert "noseTwitch" in {f.where for f in result.findings if f.code == "SHAPE_UNKNOWN"}


def test_the_calibration_may_not_go_where_an_input_is(face: Path) -> None:
    place = str(face / "take.usda")
    assert main(["calibrate", str(face / "s.usda"), "-o", place]) == 1
