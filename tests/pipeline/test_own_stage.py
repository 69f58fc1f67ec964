"""A stage of the user's over the shot: what it overrides, its clock, and when the take starts."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from processed import Done, run
from pxr import Sdf, Usd
from worlds import animation_of

from usdface.io.usd.take_write import write_take


@pytest.fixture
def own_stage(done: Done, tmp_path: Path) -> Callable[..., Path]:
    """A function that processes a stage of the user's over the shot; it returns the result.

    Overs on /Shot/Fuzzy and /Shot/Expressions are given as USD text.
    """

    def processed(fuzzy: str = "", clock: int = 30, expressions: str = "") -> Path:
        shot = tmp_path / "mine.usda"
        shot.write_text(
            f'#usda 1.0\n(\n defaultPrim = "Shot"\n timeCodesPerSecond = {clock}\n'
            f" framesPerSecond = {clock}\n subLayers = [@{done.folder / 'shot.usda'}@]\n"
            ' metersPerUnit = 1\n upAxis = "Y"\n)\n'
            f'over "Shot" {{\nover "Fuzzy" {{\n{fuzzy}\n}}\n'
            f'over "Expressions" {{\n{expressions}\n}}\n}}\n'
        )
        run("process", shot)
        return tmp_path / "mine.usdface.usda"

    return processed


def rules_of(done: Done, emotion: str) -> list[str]:
    stage = Usd.Stage.Open(str(done.folder / "shot.usda"))
    return [
        prim.GetName()
        for prim in stage.GetPrimAtPath("/Shot/Fuzzy").GetChildren()
        if f"THEN {emotion} " in str(prim.GetAttribute("usdface:text").Get())
    ]


def test_an_empty_layer_over_the_shot_changes_nothing(
    done: Done, own_stage: Callable[..., Path]
) -> None:
    np.testing.assert_array_equal(
        animation_of(own_stage()).weights, animation_of(done.root).weights
    )


def test_no_gain_is_no_correction(done: Done, own_stage: Callable[..., Path]) -> None:
    raw = animation_of(done.root, muted="express.usdc").weights
    np.testing.assert_array_equal(animation_of(own_stage("float usdface:gain = 0")).weights, raw)


def test_a_disabled_rule_takes_its_expression_away(
    done: Done, own_stage: Callable[..., Path]
) -> None:
    smiling = rules_of(done, "joy")
    overs = "\n".join(f'over "{rule}" {{\nbool usdface:enabled = 0\n}}' for rule in smiling)
    changed, before = (animation_of(root).weights for root in (own_stage(overs), done.root))
    raw = animation_of(done.root, muted="express.usdc").weights
    smile = done.world.rig.shape_names.index("mouthSmileLeft")
    assert (before[:, smile] > raw[:, smile] + 0.05).any()
    np.testing.assert_array_equal(changed[:, smile], raw[:, smile])


def test_an_inactive_expression_is_not_raised(done: Done, own_stage: Callable[..., Path]) -> None:
    changed = animation_of(own_stage(expressions='over "joy" (active = false) {\n}')).weights
    raw = animation_of(done.root, muted="express.usdc").weights
    smile = done.world.rig.shape_names.index("mouthSmileLeft")
    np.testing.assert_array_equal(changed[:, smile], raw[:, smile])


def test_another_rule_text_gives_another_expression(
    done: Done, own_stage: Callable[..., Path]
) -> None:
    rule = rules_of(done, "joy")[0]
    stage = Usd.Stage.Open(str(done.folder / "shot.usda"))
    text = stage.GetPrimAtPath(f"/Shot/Fuzzy/{rule}").GetAttribute("usdface:text").Get()
    swapped = text.replace("THEN joy", "THEN surprise")
    root = own_stage(
        "uniform double usdface:evidence = 0\nuniform double usdface:likeness = 0\n"
        f'over "{rule}" {{\nuniform string usdface:text = '
        f'"{swapped}"\n}}'
    )
    jaw = done.world.rig.shape_names.index("jawOpen")
    smiling = int(done.world.weights[:, 1].argmax())
    assert (
        animation_of(root).weights[smiling, jaw]
        > animation_of(done.root).weights[smiling, jaw] + 0.2
    )


def test_a_stage_of_another_clock_plays_at_the_same_seconds(
    done: Done, own_stage: Callable[..., Path]
) -> None:
    stage = Usd.Stage.Open(str(own_stage(clock=24)))
    assert stage.GetTimeCodesPerSecond() == 24
    played = animation_of(stage)
    np.testing.assert_allclose(played.times / 24, done.world.take.times, atol=1e-9)
    np.testing.assert_array_equal(played.weights, animation_of(done.root).weights)


def test_a_take_may_start_late_on_the_users_stage(done: Done, tmp_path: Path) -> None:
    write_take(done.world.take, tmp_path / "take.usda")
    shot = tmp_path / "late.usda"
    text = (done.folder / "shot.usda").read_text()
    text = text.replace("@./take.usda@</Take>", f"@{tmp_path / 'take.usda'}@ (offset = 1000)")
    shot.write_text(text.replace("@./rig.usda@", f"@{done.folder / 'rig.usda'}@"))
    run("process", shot)
    played = animation_of(tmp_path / "late.usdface.usda")
    np.testing.assert_array_equal(played.times, 1000 + np.arange(40))
    np.testing.assert_array_equal(played.weights, animation_of(done.root).weights)
    stage = Usd.Stage.Open(str(tmp_path / "late.usdface.usda"))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1000, 1039)


def test_a_result_has_what_usd_reads_of_the_root_layer_alone(done: Done, tmp_path: Path) -> None:
    """Expression variables, say: without them the rig would be missing in the result."""
    text = (done.folder / "shot.usda").read_text()
    (tmp_path / "below.usda").write_text(text.replace("@./rig.usda@", '@`"${RIG}"`@'))
    shot = tmp_path / "mine.usda"
    shot.write_text(
        '#usda 1.0\n(\n defaultPrim = "Shot"\n timeCodesPerSecond = 30\n metersPerUnit = 1\n'
        ' upAxis = "Y"\n subLayers = [@./below.usda@]\n kilogramsPerUnit = 0.001\n'
        ' fallbackPrimTypes = {\n  token[] Other = ["Xform"]\n }\n'
        f" expressionVariables = {{\n  string RIG = '{done.folder / 'rig.usda'}'\n }}\n)\n"
    )
    (tmp_path / "take.usda").write_bytes((done.folder / "take.usda").read_bytes())
    run("process", shot)
    root = tmp_path / "mine.usdface.usda"
    np.testing.assert_array_equal(animation_of(root).weights, animation_of(done.root).weights)
    result = Usd.Stage.Open(str(root))
    assert result.GetMetadata("kilogramsPerUnit") == 0.001
    assert {"Other", "UsdFaceRetarget"} <= set(result.GetMetadata("fallbackPrimTypes"))


@pytest.mark.parametrize(
    ("own", "played"),
    [((-20, 300), (-20, 300)), ((10, 20), (0, 39)), ((100, 200), (0, 39)), (None, (0, 39))],
)
def test_a_result_plays_the_range_of_the_shot_and_that_of_the_take(
    done: Done, tmp_path: Path, own: tuple[int, int] | None, played: tuple[int, int]
) -> None:
    shot = tmp_path / "mine.usda"
    stage = Usd.Stage.CreateNew(str(shot))
    stage.GetRootLayer().TransferContent(Sdf.Layer.FindOrOpen(str(done.folder / "shot.usda")))
    for name in ("rig.usda", "take.usda"):
        (tmp_path / name).write_bytes((done.folder / name).read_bytes())
    stage.GetRootLayer().ClearStartTimeCode()
    stage.GetRootLayer().ClearEndTimeCode()
    if own:
        stage.SetStartTimeCode(own[0])
        stage.SetEndTimeCode(own[1])
    stage.Save()
    run("process", shot)
    result = Usd.Stage.Open(str(tmp_path / "mine.usdface.usda"))
    assert (result.GetStartTimeCode(), result.GetEndTimeCode()) == played
