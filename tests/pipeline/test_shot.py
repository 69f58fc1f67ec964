from dataclasses import replace
from pathlib import Path

import pytest
from pxr import Usd
from worlds import make_world

from usdface.cli import main
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file
from usdface.pipeline import make_shot


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A shot, and beside it the system of it with a correction of its own."""
    folder = make_world(head_moves=False).write(tmp_path_factory.mktemp("face"))
    assert shot(folder, "designed.usda") == 0
    system = replace(correction_of(folder, "designed.usda"), mode="add", gain=0.5, ease=0.25)
    write_fuzzy_file(folder / "own.usda", system)
    return folder


def shot(folder: Path, name: str, *options: str) -> int:
    files = [f"--{n}={folder / n}.usda" for n in ("rig", "take")]
    return main(["shot", *files, f"--bind={folder}/bind.json", f"-o={folder / name}", *options])


def correction_of(folder: Path, name: str) -> ExpressionSystem:
    return read_fuzzy_file(folder / name)[0]


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        ([], ("add", 0.5, 0.25)),
        (["--gain", "0.7"], ("add", 0.7, 0.25)),
        (["--mode", "raise"], ("raise", 0.5, 0.25)),
        (["--ease", "0"], ("add", 0.5, 0.0)),
    ],
)
def test_a_system_that_is_given_keeps_its_correction_but_for_what_is_told(
    folder: Path, given: list[str], wanted: tuple[str, float, float]
) -> None:
    assert shot(folder, "shot.usda", f"--fuzzy={folder}/own.usda", *given) == 0
    system = correction_of(folder, "shot.usda")
    assert (system.mode, system.gain, system.ease) == wanted


def test_a_designed_system_has_the_defaults_but_for_what_is_told(folder: Path) -> None:
    assert shot(folder, "shot.usda", "--ease", "0.5") == 0
    system = correction_of(folder, "shot.usda")
    assert (system.mode, system.gain, system.ease) == ("raise", 1.0, 0.5)


def test_a_correction_that_cannot_be_is_refused(folder: Path) -> None:
    files = (folder / "rig.usda", folder / "take.usda", folder / "no.usda")
    bind = folder / "bind.json"
    for system in (None, folder / "own.usda"):
        with pytest.raises(InputError, match="'gain' is -1"):
            make_shot(*files, bind=bind, correction={"gain": -1.0}, fuzzy=system)
    assert not (folder / "no.usda").exists()


def test_a_shot_or_its_result_is_refused_as_the_rig_of_another(
    folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(["process", f"{folder}/designed.usda", f"-o={folder}/played.usda"]) == 0
    capfd.readouterr()
    for name in ("designed", "played"):
        files = [f"--rig={folder}/{name}.usda", f"--take={folder}/take.usda"]
        output = tmp_path / f"{name}.usda"
        assert main(["shot", *files, f"--bind={folder}/bind.json", f"-o={output}"]) == 1
        error = capfd.readouterr().err
        assert error.count("\n") == 1 and f"{name}.usda is a shot" in error
        assert "UsdFaceRetarget prim /" in error and "the rig itself" in error
        assert not output.exists()
    with pytest.raises(InputError, match="is a shot") as refused:
        make_shot(folder / "played.usda", folder / "take.usda", tmp_path / "no.usda")
    assert refused.value.code == "SHOT_AS_RIG"


@pytest.mark.parametrize("places", [["/Cast"], ["/Hero/Hero"], ["/Cast", "/Hero/Hero"]])
def test_a_shot_of_an_instance_can_be_processed(folder: Path, places: list[str]) -> None:
    """As what instances share cannot be animated, the character is none in the shot."""
    rig = Usd.Stage.Open(f"{folder}/rig.usda")
    hero = Usd.Stage.CreateNew(str(folder / "hero.usda"))
    hero.DefinePrim("/Hero/Hero").GetReferences().AddReference("rig.usda")
    hero.SetDefaultPrim(hero.GetPrimAtPath("/Hero"))
    hero.GetPrimAtPath("/Hero/Hero").SetInstanceable("/Hero/Hero" in places)
    hero.Save()
    stage = Usd.Stage.CreateNew(str(folder / "cast.usda"))
    stage.DefinePrim("/Cast").GetReferences().AddReference("hero.usda")
    stage.SetDefaultPrim(stage.GetPrimAtPath("/Cast"))
    for name in ("metersPerUnit", "upAxis"):
        stage.SetMetadata(name, rig.GetMetadata(name))
    stage.GetPrimAtPath("/Cast").SetInstanceable("/Cast" in places)
    stage.Save()
    files = [f"--rig={folder}/cast.usda", f"--take={folder}/take.usda"]
    assert main(["shot", *files, f"--bind={folder}/bind.json", f"-o={folder}/cast_shot.usda"]) == 0
    assert main(["process", f"{folder}/cast_shot.usda", "-o", f"{folder}/cast_played.usda"]) == 0
