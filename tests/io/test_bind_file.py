import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from whole_setup import lost_fields

from usdface.errors import InputError
from usdface.io.bind_file import bind_json, read_bind, setup_of_json
from usdface.options import CleanOptions, MapOptions, SolveOptions
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup

SETUPS = [
    RetargetSetup(Binding(("a", "b"), np.array([3, 9]), "/Asset/Face/Head")),
    RetargetSetup(
        Binding(("a", "b", "ä ö"), np.array([3, 3, 0])),
        head="markers",
        head_markers=("a", "b", "ä ö"),
        move_head=True,
        neutral=(4, 40),
        nose_tip="a",
        roles={"lip_lower": "b"},
        curves={"jawOpen": {"mouth-open": 0.8, "chin": -0.3}, "tongueOut": {}},
        map=MapOptions(kernel="gaussian", form="paper", radius=2.0),
        solve=SolveOptions(smoothness=0.0),
        clean=CleanOptions(spikes=False),
    ),
    RetargetSetup(Binding(("a",), np.array([1])), head="stabilised", neutral=None),
]


@pytest.mark.parametrize("setup", SETUPS)
def test_a_setup_survives_the_file(tmp_path: Path, setup: RetargetSetup) -> None:
    path = tmp_path / "bind.json"
    path.write_text(bind_json(setup), encoding="utf-8")
    back, findings = read_bind(path)
    assert findings == []
    assert back.binding.markers == setup.binding.markers
    np.testing.assert_array_equal(back.binding.points, setup.binding.points)
    same = ("head", "head_markers", "move_head", "neutral", "nose_tip", "curves", "map", "solve")
    for name in same:
        assert getattr(back, name) == getattr(setup, name)
    assert dict(back.roles) == dict(setup.roles) and back.binding.mesh == setup.binding.mesh


def test_no_field_of_a_setup_is_forgotten() -> None:
    """Pins and calibration are of a shot; neutral frames that are written are named ones."""

    def there_and_back(setup: RetargetSetup) -> RetargetSetup:
        named = replace(setup, neutral_assumed=False)
        return setup_of_json(json.loads(bind_json(named)), "bind.json")

    lost = lost_fields(there_and_back)
    assert lost == {"pins", "calibration", "neutral_assumed"}, "usdface/io/bind_file.py"


def test_only_markers_are_needed(tmp_path: Path) -> None:
    path = tmp_path / "bind.json"
    # With the byte order mark of some editors.
    path.write_text('{"markers": {"a": {"point": 1}}}', encoding="utf-8-sig")
    setup, findings = read_bind(path)
    assert setup.neutral_assumed and findings == []
    assert setup.head == "solve" and setup.neutral == (0, 0)
    assert setup.map == MapOptions() and setup.solve == SolveOptions()


def test_a_take_of_weights_needs_no_markers() -> None:
    setup = setup_of_json({"curves": {"jawOpen": {"mouth-open": 1}}}, "bind.json")
    assert setup.binding.markers == () and setup.curves["jawOpen"]["mouth-open"] == 1.0
    assert setup_of_json({"head_joint": "neck/head"}, "bind.json").head_joint == "neck/head"
    with pytest.raises(InputError, match='"markers" as an object'):
        setup_of_json({}, "bind.json")


def test_joints_of_the_eyes_and_a_factor_on_their_turns() -> None:
    eyes = {"joints": ["eye.L", "eye.R"], "turn": 0.5}
    setup = setup_of_json({"eyes": eyes, "curves": {"a": {"b": 1}}}, "bind.json")
    assert setup.eye_joints == ("eye.L", "eye.R") and setup.eye_turn == 0.5
    assert json.loads(bind_json(setup))["eyes"] == eyes
    assert "eyes" not in json.loads(bind_json(RetargetSetup(Binding(("a",), np.array([1])))))


def test_a_neutral_says_whether_it_is_taken_off() -> None:
    neutral = {"start": 3, "end": 9, "removed": False}
    setup = setup_of_json({"markers": {}, "neutral": neutral}, "bind.json")
    assert setup.neutral_removed is False
    assert json.loads(bind_json(setup))["neutral"] == neutral
    unsaid = setup_of_json({"markers": {}, "neutral": {"start": 3, "end": 9}}, "bind.json")
    assert unsaid.neutral_removed is None
    with pytest.raises(InputError, match='"removed" of "neutral" is 1'):
        setup_of_json({"markers": {}, "neutral": neutral | {"removed": 1}}, "bind.json")


@pytest.mark.parametrize(
    "eyes",
    [
        ["eye.L", "eye.R"],
        {"joints": "eye.L"},
        {"joints": ["eye.L"]},
        {"joints": ["a", 1]},
        {"turn": True},
        {"turn": -0.5},
        {"turn": float("nan")},
        {"turn": 5},
        {"gain": 1.0},
    ],
)
def test_other_eyes_are_refused(eyes: object) -> None:
    with pytest.raises(InputError, match="eyes"):
        setup_of_json({"markers": {}, "eyes": eyes}, "bind.json")


def test_neutral_frames_that_nobody_named_are_not_written() -> None:
    setup = RetargetSetup(Binding(("a",), np.array([1])), neutral_assumed=True)
    text = bind_json(setup)
    assert "neutral" not in json.loads(text)
    assert setup_of_json(json.loads(text), "bind.json").neutral_assumed


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"marker": {}}, "unknown key 'marker'"),
        ({"markers": []}, '"markers" as an object'),
        ({"markers": {"a": 3}}, "marker 'a' is 3"),
        ({"markers": {"a": {"point": -1}}}, "marker 'a'"),
        ({"markers": {"a": {"point": True}}}, "marker 'a'"),
        ({"markers": {"a": {"point": 2**40}}}, "marker 'a'"),
        ({"head": "stabilized"}, "stabilised"),
        ({"head": []}, "rigid markers"),
        ({"head": ["a", "b"]}, "at least three"),
        ({"neutral": {"start": 5, "end": 2}}, '"neutral"'),
        ({"neutral": "frame 3"}, '"neutral"'),
        ({"neutral": {"first": 3, "last": 5}}, '"neutral"'),
        ({"neutral": {"start": 3, "stop": 5}}, '"neutral"'),
        ({"neutral": {"start": False, "end": True}}, '"neutral"'),
        ({"roles": {"lip": 3}}, "role 'lip'"),
        ({"curves": ["jawOpen"]}, '"curves"'),
        ({"curves": {"jawOpen": "jaw"}}, '"curves"'),
        ({"curves": {"jawOpen": {"jaw": True}}}, "is True; expected -4 to 4"),
        ({"curves": {"jawOpen": {"jaw": 5.0}}}, "expected -4 to 4"),
        ({"map": {"radios": 3}}, "radius"),
        ({"map": {"radius": "3"}}, "'radius' is '3'"),
        ({"map": {"kernel": "cubic"}}, "kernel"),
        ({"map": {"form": "absolute"}}, "form"),
        ({"map": {"radius": 0.0}}, "radius"),
        ({"solve": {"smoothness": -1.0}}, "smoothness"),
        ({"solve": {"spread": 0}}, "spread"),
        ({"solve": 3}, '"solve"'),
    ],
)
def test_nonsense_is_refused_in_one_line(change: dict[str, object], message: str) -> None:
    document = {"markers": {"a": {"point": 1}}} | change
    with pytest.raises(InputError) as caught:
        setup_of_json(document, "bind.json")
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_files_that_are_no_binding_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot read"):
        read_bind(tmp_path / "none.json")
    for content in ("", "{", "[1, 2]", '"text"', "\ufeff{}", 100_000 * "["):
        (tmp_path / "bad.json").write_text(content, encoding="utf-8")
        with pytest.raises(InputError, match=r"bad\.json"):
            read_bind(tmp_path / "bad.json")
    (tmp_path / "bad.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"bad\.json is no text; expected JSON"):
        read_bind(tmp_path / "bad.json")
    assert json.loads(bind_json(SETUPS[0]))["mesh"] == "/Asset/Face/Head"


@pytest.mark.parametrize(
    "setting",
    [
        '"exaggeration": {}',
        '"solve": {{"smoothness": {}}}',
        '"neutral": {{"weights": {{"a": {}}}}}',
        '"curves": {{"a": {{"b": {}}}}}',
    ],
)
def test_a_number_of_hundreds_of_digits_is_refused(tmp_path: Path, setting: str) -> None:
    text = f'{{"markers": {{"a": {{"point": 1}}}}, {setting.format("1" + 400 * "0")}}}'
    (tmp_path / "bind.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="is inf"):
        read_bind(tmp_path / "bind.json")


def test_a_marker_that_is_bound_twice_is_named(tmp_path: Path) -> None:
    text = '{"markers": {"chin": {"point": 1}, "nose": {"point": 2}, "chin": {"point": 3}}}'
    (tmp_path / "bind.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"bind\.json .* 'chin' occurs twice"):
        read_bind(tmp_path / "bind.json")


def test_a_map_whose_settings_are_named_is_not_chosen() -> None:
    def map_of(**settings: object) -> MapOptions:
        return setup_of_json({"markers": {"a": {"point": 1}}, "map": settings}, "bind").map

    assert map_of(radius=2.0) == MapOptions(choice="fixed", radius=2.0)
    assert map_of(radius=2.0, choice="auto") == MapOptions(radius=2.0)
    assert map_of(form="paper") == MapOptions(form="paper")


def test_how_sure_a_place_is_stays_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "bind.json"
    binding = Binding(("a", "b"), np.array([1, 2]), confidence=np.array([0.25, np.nan]))
    path.write_text(bind_json(RetargetSetup(binding)), encoding="utf-8")
    markers = json.loads(path.read_text())["markers"]
    assert markers == {"a": {"point": 1, "confidence": 0.25}, "b": {"point": 2}}
    back, _ = read_bind(path)
    np.testing.assert_array_equal(back.binding.confidence, [0.25, np.nan])


@pytest.mark.parametrize("wrong", [-0.1, 2, "high", True, float("nan")])
def test_a_confidence_is_a_share(wrong: object) -> None:
    with pytest.raises(InputError, match='"confidence"'):
        setup_of_json({"markers": {"a": {"point": 1, "confidence": wrong}}}, "bind.json")


def test_unsure_places_are_kept_and_not_bound(tmp_path: Path) -> None:
    unsure = Binding(("b", "c"), np.array([4, 5]), confidence=np.array([0.25, 0.0]))
    setup = RetargetSetup(Binding(("a",), np.array([1])), unsure=unsure)
    back = setup_of_json(json.loads(bind_json(setup)), "bind.json")
    assert back.binding.markers == ("a",) and back.unsure.markers == ("b", "c")
    np.testing.assert_array_equal(back.unsure.points, [4, 5])
    assert bind_json(back) == bind_json(setup)
    # A place that was checked and copied to the markers is bound.
    checked = json.loads(bind_json(setup))
    checked["markers"]["b"] = {"point": 7}
    back = setup_of_json(checked, "bind.json")
    assert back.binding.markers == ("a", "b") and back.unsure.markers == ("c",)
