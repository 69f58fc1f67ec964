"""Show files: shots, the tables that they share, and mistakes in them."""

from pathlib import Path

import pytest

from usdface.errors import InputError
from usdface.show.plan import plan_of, same_outputs
from usdface.show.show_file import read_show_file
from usdface.show.show_json import show_json

SHOW = """
folder = "shots"
[process]
gltf = true
skip_hooks = ["studio-hooks"]
exaggeration = {brows = 1.2}
[characters.mia]
rig = "mia.usdc"
layer = "sets/mia.usda"
bind = {anna = "anna_on_mia.json", ben = "ben_on_mia.json"}
gain = 0.8
[characters.tom]
rig = "tom.usdc"
bind = "tom.json"
[performers.anna]
calibration = "anna.json"
gain = 0.9
[[shots]]
name = "010"
take = "takes/010.usdc"
performer = "anna"
characters = ["mia", "tom"]
[[shots]]
take = "takes/020.usdc"
character = "mia"
performer = "anna"
gain = 0.5
neutral = [3, 20]
[shots.process]
gltf = false
skip_hooks = []
deliver = {start = 1001, end = 1096, handles = 8, rate = 24.0}
"""


def show(folder: Path, text: str) -> Path:
    (folder / "show.toml").write_text(text)
    return folder / "show.toml"


def test_a_shot_goes_before_its_performer_and_that_before_its_character(tmp_path: Path) -> None:
    plans = read_show_file(show(tmp_path, SHOW))
    assert plans == read_show_file(show(tmp_path, "\ufeff" + SHOW))  # as some editors save it
    assert [plan.name for plan in plans] == ["010_mia", "010_tom", "020"]
    first, second, third = plans
    assert first.file == tmp_path / "shots/010_mia.usda"
    assert first.making is not None and second.making is not None and third.making is not None
    assert first.making.rig == tmp_path / "mia.usdc"
    assert first.making.take == second.making.take == tmp_path / "takes/010.usdc"
    assert first.making.bind == tmp_path / "anna_on_mia.json"
    assert second.making.bind == tmp_path / "tom.json"
    assert first.making.calibration == tmp_path / "anna.json"
    assert first.making.character_layer == tmp_path / "sets/mia.usda"
    assert first.making.performer_layer is second.making.character_layer is None
    gains = [plan.making.correction["gain"] for plan in plans]
    assert gains == [0.9, 0.9, 0.5]
    assert third.making.neutral == (3, 20)
    assert [plan.gltf for plan in plans] == [True, True, False]
    assert (first.deliver, third.deliver and third.deliver["handles"]) == (None, 8)
    assert [plan.skip_hooks for plan in plans] == [("studio-hooks",), ("studio-hooks",), ()]
    assert dict(third.process) == {"exaggeration": {"brows": 1.2}}


def test_plans_come_back_from_plain_values_and_from_json(tmp_path: Path) -> None:
    plans = read_show_file(show(tmp_path, SHOW))
    assert [plan_of(plan.as_dict()) for plan in plans] == plans
    (tmp_path / "list").mkdir()
    (tmp_path / "list/shots.json").write_text(show_json(plans, tmp_path))
    again = read_show_file(tmp_path / "list/shots.json", tmp_path)
    assert [p.as_dict() | {"making": 0} for p in again] == [
        p.as_dict() | {"making": 0} for p in plans
    ]
    for one, other in zip(again, plans, strict=True):
        assert one.making is not None and other.making is not None
        assert one.making.files == other.making.files
        assert one.making.options == other.making.options
        assert one.making.layers == other.making.layers
        assert one.making.performer == other.making.performer
    with pytest.raises(InputError, match="is not in"):
        show_json(plans, tmp_path / "shots")


def test_a_performer_has_a_file_and_a_layer_for_each_character(tmp_path: Path) -> None:
    """Gains are shares of a character's shapes: those on one say nothing of another."""
    files = """calibration = {mia = "anna_on_mia.json", tom = "anna_on_tom.json"}
layer = {mia = "sets/anna_on_mia.usda"}"""
    text = SHOW.replace('calibration = "anna.json"', files)
    makings = [plan.making for plan in read_show_file(show(tmp_path, text)) if plan.making]
    names = [making.calibration and making.calibration.name for making in makings]
    assert names == ["anna_on_mia.json", "anna_on_tom.json", "anna_on_mia.json"]
    layers = [making.performer_layer and making.performer_layer.name for making in makings]
    assert layers == ["anna_on_mia.usda", None, "anna_on_mia.usda"]
    wrong = text.replace("calibration = {mia = ", "calibration = {mai = ")
    with pytest.raises(InputError, match="anna: no calibration for 'mia'; did you mean mai"):
        read_show_file(show(tmp_path, wrong))


@pytest.mark.parametrize(
    ("own", "message"),
    [
        (
            'performer = "ben"',
            r"show.toml: \S*mia.usda holds the bind of one shot .* 010_mia has anna_on_mia.json",
        ),
        ('performer = "anna"\nbind = "mended.json"', "and 030 mended.json; give each a layer"),
        ('performer = "ben"\ncharacter_layer = "sets/ben.usda"', ""),
    ],
)
def test_one_layer_for_two_bindings_is_refused(tmp_path: Path, own: str, message: str) -> None:
    """The first shot would write it, and the other be solved with the first one's binding."""
    more = f"""[performers.ben]
[[shots]]
take = "takes/030.usdc"
character = "mia"
{own}
"""
    place = show(tmp_path, SHOW + more)
    if not message:
        assert len(read_show_file(place)) == 4
        return
    with pytest.raises(InputError, match=message):
        read_show_file(place)


def test_files_of_one_name_are_told_apart(tmp_path: Path) -> None:
    text = SHOW.replace("anna_on_mia.json", "anna/mia.json").replace("tom.json", "tom/mia.json")
    text = text.replace('rig = "tom.usdc"', 'rig = "mia.usdc"\nlayer = "sets/mia.usda"')
    with pytest.raises(InputError, match=r"010_mia has \S*anna/mia.json and 010_tom \S*tom/mia"):
        read_show_file(show(tmp_path, text))


def test_one_layer_for_two_calibrations_is_refused(tmp_path: Path) -> None:
    files = """calibration = {mia = "a.json", tom = "b.json"}
layer = "sets/anna.usda\""""
    text = SHOW.replace('calibration = "anna.json"', files)
    with pytest.raises(InputError, match=r"anna.usda holds the calibration .* a.json and 010_tom"):
        read_show_file(show(tmp_path, text))


def test_a_misspelt_performer_of_a_binding_is_refused(tmp_path: Path) -> None:
    """Else its shots would be bound by proposal; other performers may have a binding, or none."""
    wrong = SHOW.replace("bind = {anna = ", "bind = {ana = ")
    with pytest.raises(InputError, match="mia: no bind for 'anna'; did you mean ana"):
        read_show_file(show(tmp_path, wrong))
    known = show(tmp_path, f"{wrong}[performers.ana]\n")
    assert [p.making.bind for p in read_show_file(known) if p.making][::2] == [None, None]


def test_shots_that_are_there_are_found_by_pattern(tmp_path: Path) -> None:
    for name in ("a.usda", "b.usda", "b.usdface.usda", "c.txt"):
        (tmp_path / name).touch()
    plans = read_show_file(show(tmp_path, 'files = ["*.usda"]'))
    assert [(plan.name, plan.making) for plan in plans] == [("a", None), ("b", None)]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("shots = 3", "expected a list"),
        ("shotz = []", "did you mean shots"),
        ("[[shots]]\ntake = 'a'", "has no rig"),
        ("[[shots]]\nrig = 'a'\nname = 'x'", r"shot 1 \(x\) has no take"),
        (
            "[[shots]]\ntake = 'a'\nrig = 'b'\ncharacter = 'mia'",
            r"'mia'; add a table \[characters\.mia\]",
        ),
        ("[[shots]]\ntake = 'a'\nrig = 'b'\ngian = 1", "did you mean gain"),
        ("[[shots]]\ntake = 'a'\nrig = 'b'\nname = '../x'", "cannot be the name"),
        ("[[shots]]\ntake = 'a'\nrig = 'b'\nneutral = [1.5, 2]", "frame index"),
        ("[[shots]]\ntake = 'a'\nrig = 'b'\nprocess = {gain = 1}", "unknown key 'gain'"),
        ("[[shots]]\ntake = 'a'\nrig = 'b'\n[[shots]]\ntake = 'a'\nrig = 'c'", "two shots"),
        ("files = ['*.usda']", "no file matches"),
        ("files = ['/etc/*.usda']", "absolute|Non-relative"),
        ("folder = [", "cannot be read"),
        ('folder = "a\\u0000b"', "expected text"),
        ("files = ['*']\nprocess = {solve = 'all'}", "solve"),
        ("files = ['*']\nprocess = {express = 1}", "true or false"),
        ("files = ['*']\nprocess = {deliver = {start = 9, end = 1}}", "ends at 1"),
        ("files = ['*']\nprocess = {deliver = {start = 1.5}}", "expected a number"),
        ("files = ['*']\nprocess = {deliver = {first = 1}}", "known: start, end, handles, rate"),
        ("files = ['*']\nprocess = {exaggeration = {nose = 2}}", "nose"),
        ("files = ['*']\nprocess = {exaggeration = 1.2}", "exaggeration is 1.2; expected a table"),
        (
            "files = ['*']\nprocess = {gains = {joy = 'x'}}",
            "gains of joy is 'x'; expected a number",
        ),
        ("[[shots]]\ntake = 'a'\nrig = 'b'\ngain = 'x'", "gain is 'x'; expected a number"),
        ("[[shots]]\ntake = 'a'\nrig = 'b'\nease = 2", "'ease' is 2; expected 0 to 1"),
        ("[[shots]]\ntake = 'a'\nrig = 'b'\nmode = 'x'", "'mode' is 'x'; expected raise, add"),
    ],
)
def test_a_mistake_is_named(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_show_file(show(tmp_path, text))


def test_shots_that_write_one_file_are_named(tmp_path: Path) -> None:
    text = "[[shots]]\nname='a'\ntake='t'\nrig='r'\n[[shots]]\nname='b'\nfile='a.usdc'\n"
    plans = read_show_file(show(tmp_path, text + "[[shots]]\nname='c'\ntake='t'\nrig='r'"))
    assert same_outputs(plans) == {
        0: (tmp_path / "a.usdface.usda", "b"),
        1: (tmp_path / "a.usdface.usda", "a"),
    }
