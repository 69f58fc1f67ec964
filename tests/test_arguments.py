"""Wrong arguments of public functions and types: one line that says what to give instead."""

import gc
import inspect
import pickle
import weakref
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from pxr import Usd
from worlds import World, make_world

import usdface
from usdface.arguments import checked
from usdface.arrays import FloatArray, IntArray


@checked
@dataclass(frozen=True)
class Track:
    names: tuple[str, ...]
    places: FloatArray | None = None
    points: IntArray | None = None
    size: tuple[int, int] | None = None
    axis: Literal["Y", "Z"] = "Y"


@checked
def measure(
    track: Track,
    *,
    path: str | PathLike[str] | None = None,
    tags: Sequence[str] = (),
    poses: Mapping[str, Track] | None = None,
    rate: float = 0.0,
    frame: int | None = None,
    loud: bool = False,
    report: Callable[[str], object] | None = None,
) -> dict[str, Any]:
    return dict(locals())


TRACK = Track(("nose",))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"path": TRACK}, "path is of type Track; expected a path or None"),
        ({"path": b"a"}, "path is of type bytes; expected a path or None"),
        ({"tags": "abc"}, "tags is 'abc'; expected a list of text"),
        ({"tags": ["a", 3]}, "tags[1] is 3; expected text"),
        ({"poses": {"joy": {"jawOpen": 1}}}, "poses['joy'] is the dict {'jawOpen': 1}; expected"),
        ({"rate": "60"}, "rate is '60'; expected a number"),
        ({"rate": np.ones(3)}, "rate is an array of float64, shape (3,); expected a number"),
        ({"frame": 1.5}, "frame is 1.5; expected a whole number or None"),
        ({"frame": True}, "frame is True; expected a whole number or None"),
        ({"loud": 2}, "loud is 2; expected True or False"),
        ({"loud": "no"}, "loud is 'no'; expected True or False"),
        ({"report": True}, "report is True; expected a function or None"),
    ],
)
def test_a_wrong_argument_is_named(given: dict[str, Any], message: str) -> None:
    with pytest.raises(usdface.InputError) as raised:
        measure(TRACK, **given)
    assert str(raised.value).startswith(f"measure(): {message}")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"names": "nose"}, "names is 'nose'; expected a list of text"),
        ({"names": ("a",), "places": [["a"]]}, "places is of type list; expected an array"),
        ({"names": ("a",), "places": [[1], [1, 2]]}, "places, with rows of several lengths, is of"),
        ({"names": ("a",), "places": [TRACK]}, "places is of type list; expected an array of real"),
        ({"names": ("a",), "points": [None]}, "points is the list [None]; expected an array of"),
        ({"names": ("a",), "places": 1j * np.ones(1)}, "places is an array of complex128, shape"),
        (
            {"names": ("a",), "points": [0.5]},
            "points is the list [0.5]; expected an array of",
        ),
        ({"names": ("a",), "size": (1, 2, 3)}, "size is the tuple (1, 2, 3); expected (a whole"),
        ({"names": ("a",), "size": 7}, "size is 7; expected (a whole number, a whole number) or"),
        ({"names": ("a",), "axis": 1}, "axis is 1; expected 'Y', 'Z'"),
        (
            {"names": ("a",), "axis": np.array(["Y"])},
            "axis is an array of <U1, shape (1,); expected",
        ),
    ],
)
def test_a_wrong_field_is_named(given: dict[str, Any], message: str) -> None:
    with pytest.raises(usdface.InputError) as raised:
        Track(**given)
    assert str(raised.value).startswith(f"Track(): {message}")


def test_what_means_the_same_is_taken() -> None:
    track = Track(["a", "b"], [[1, 2]], [3.0], [1920, np.int64(1080)])  # type: ignore[arg-type]
    assert track.names == ("a", "b") and track.size == (1920, 1080)
    assert isinstance(track.places, np.ndarray) and isinstance(track.size, tuple)
    given = measure(track, path=Path("a"), tags=["a"], rate=np.float32(24), frame=np.int64(3))
    assert given["track"] is track and given["rate"] == 24 and type(given["frame"]) is int


@pytest.mark.parametrize(
    "given",
    [
        ["a", "b"],
        (each for each in "ab"),
        {"a": 1, "b": 2},
        {"a": 1, "b": 2}.keys(),
        np.array(["a", "b"]),
    ],
)
def test_an_iterable_is_taken_for_a_tuple(given: Any) -> None:
    names = Track(given).names
    assert names == ("a", "b") and measure(TRACK, tags=iter(names))["tags"] == names  # type: ignore[arg-type]


def test_none_among_numbers_is_unknown() -> None:
    positions: Any = [[[0, 0, 0]], [[None] * 3]]
    take = usdface.MarkerTake(("nose",), [0, 1], positions)  # type: ignore[arg-type]
    assert take.visible.tolist() == [[True], [False]]
    confidence: Any = np.array([None, 1], dtype=object)
    binding = usdface.Binding(("a", "b"), [1, 2], confidence=confidence)  # type: ignore[arg-type]
    np.testing.assert_array_equal(binding.confidence, [np.nan, 1.0])
    assert Track(("a",), places=None).places is None


def test_numbers_that_a_mask_hides_are_unknown() -> None:
    masked = np.ma.masked_equal([[[0.0, 0.0, 0.0]], [[9999.0] * 3]], 9999.0)
    take = usdface.MarkerTake(("nose",), [0, 1], masked)  # type: ignore[arg-type]
    assert take.visible.tolist() == [[True], [False]]
    with pytest.raises(usdface.InputError, match="points is an array of int64"):
        Track(("a",), points=np.ma.masked_equal([1, 2], 2))
    assert Track(("a",), points=np.ma.masked_equal([1, 2], 3)).points.tolist() == [1, 2]  # type: ignore[union-attr]


@pytest.mark.parametrize("number", [2.0, np.int64(2), np.float32(2), np.array(2.0)])
def test_numbers_are_taken_of_any_type(number: Any) -> None:
    given = measure(TRACK, frame=number, rate=number)
    assert given["frame"] == given["rate"] == 2 and type(given["frame"]) is int
    assert Track(("a",), size=(number, number)).size == (2, 2)
    assert usdface.TakeOptions(dimension=number).dimension == 2


@pytest.mark.parametrize("truth", [0, 0.0, np.False_, np.array(0)])
def test_0_and_1_are_truth_values(truth: Any) -> None:
    assert usdface.CleanOptions(blinks=truth).blinks is False
    assert measure(TRACK, loud=truth + 1)["loud"] is True


def test_a_path_is_taken_for_text() -> None:
    root: Any = Path("show/assets")
    for kind in (usdface.ExportOptions, usdface.ImportOptions, usdface.RigOptions):
        assert kind(asset_root=root).asset_root == str(root)
    assert usdface.ViewOptions(asset_root=root).asset_root == str(root)
    options = usdface.TakeOptions(dots=root, names=root)
    assert options.dots == str(root) and options.names is root
    take = usdface.MarkerTake(("nose",), WORLD.take.times[:1], np.zeros((1, 1, 3)), source=root)
    assert take.source == str(root)


def test_a_value_that_cannot_be_read_is_refused_like_others() -> None:
    class Broken:
        @property
        def value(self) -> None:
            raise RuntimeError("closed")

    with pytest.raises(usdface.InputError, match=r"is of type Broken; expected Track$"):
        measure(Broken())  # type: ignore[arg-type]


def test_a_file_that_the_system_refuses_is_an_error_of_usdface() -> None:
    with pytest.raises(usdface.InputError, match="cannot be read: File name too long") as raised:
        usdface.check(300 * "a" + ".usda")
    assert raised.value.code == "FILE_UNREADABLE"

    def closed(step: usdface.Step) -> None:
        raise BrokenPipeError(32, "Broken pipe")

    with pytest.raises(BrokenPipeError):  # of the caller's own function
        usdface.check("a.usda", on_progress=closed)


def test_frames_and_sizes_are_taken_of_any_iterable() -> None:
    size: Any = np.array([1920, 1080])
    assert Track(("a",), size=size).size == (1920, 1080)
    for frames in (range(3), np.arange(3), {0: "rest", 1: "blink", 2: "held"}):
        assert usdface.BindOptions(peaks=frames).peaks == (0, 1, 2)  # type: ignore[arg-type]


def test_files_are_taken_of_any_iterable(tmp_path: Path) -> None:
    path = tmp_path / "a.usda"
    Usd.Stage.CreateNew(str(path)).Save()
    paths: Any = {str(path): 1}
    assert usdface.check(paths).summary["files"] == 1
    assert usdface.check(tmp_path.glob("*.usda")).summary["files"] == 1
    assert usdface.installed_hooks(set())[1] == []  # type: ignore[arg-type]


def test_wrong_names_of_arguments_stay_errors_of_the_call() -> None:
    with pytest.raises(TypeError, match="'pathe'"):
        measure(TRACK, pathe="a")  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="takes 1 positional"):
        measure(TRACK, "a")  # type: ignore[misc]


@pytest.mark.parametrize("name", usdface.__all__)
def test_every_public_function_is_checked(name: str) -> None:
    public = getattr(usdface, name)
    if inspect.isfunction(public) and name != "finding":  # whose values are of any type
        assert pickle.loads(pickle.dumps(public)) is public
        for parameter, described in inspect.signature(public).parameters.items():
            assert described.annotation not in (inspect.Parameter.empty, Any), parameter
            with pytest.raises(
                usdface.InputError, match=rf"^{name}\(\): {parameter} is of type object"
            ):
                public(**{parameter: object()})


WORLD = make_world()


@pytest.mark.parametrize(
    ("call", "remedy"),
    [
        (lambda w: usdface.assemble_shot(w.rig, w.take, setup="bind.json"), "usdface.read_bind("),
        (lambda w: usdface.assemble_shot("head.usdc", w.take), "usdface.read_rig(path) makes one"),
        (lambda w: usdface.assemble_shot((w.rig, []), w.take), "give the first of this pair"),
        (lambda w: usdface.assemble_shot(w.take, w.rig), "expected Rig; usdface.read_rig("),
        (lambda w: usdface.retarget("shot.usda"), "usdface.assemble_shot(rig, take) makes one"),
        (lambda w: usdface.correct(usdface.Result(RESULT)), "value of this result: result.value"),
        (lambda w: usdface.process(w.take), "arrays go to usdface.assemble_shot and usdface.ret"),
        (lambda w: usdface.apply("shot.usda"), "Usd.Stage.Open(path) makes one"),
        (lambda w: usdface.RetargetSetup({"nose": 3}), "usdface.Binding(markers, points) makes"),
    ],
)
def test_the_step_that_was_left_out_is_named(call: Callable[[World], object], remedy: str) -> None:
    with pytest.raises(usdface.InputError) as raised:
        call(WORLD)
    assert remedy in str(raised.value)


SHOT, _ = usdface.assemble_shot(WORLD.rig, WORLD.take, setup=WORLD.setup())
RESULT = usdface.ShotResult(
    SHOT, usdface.WeightsTake(("jawOpen",), WORLD.take.times, np.zeros((len(WORLD.take.times), 1)))
)


@checked
def numbered(names: tuple[int, ...] | tuple[str, ...]) -> int:
    return len(names)


def test_nothing_of_the_caller_is_kept_alive() -> None:
    """An open stage would be found again below its path by the next to open it."""

    class Stage:
        pass

    def call() -> "weakref.ref[Stage]":
        stage = Stage()
        assert numbered(("a", "b")) == 2
        return weakref.ref(stage)

    gc.disable()
    try:
        assert call()() is None
    finally:
        gc.enable()
