"""The main job on arrays is the one on files, and needs neither stage nor file."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from worlds import World, animation_of, make_world

import usdface
from usdface import Cancelled, InputError, MarkerTake, ProcessOptions, Shot, Step, WeightsTake
from usdface.face.shape_names import split_words
from usdface.shot.report import report_of

SCRIPT = """
import sys
import numpy as np
import usdface
from usdface import Binding, BlendShape, MarkerTake, Mesh, RetargetSetup, Rig, Shot

data = np.load(sys.argv[1])
names = tuple(data["names"].tolist())
shapes = tuple(
    BlendShape.from_dense(name, offsets) for name, offsets in zip(names, data["offsets"])
)
mesh = Mesh("head", data["points"], data["counts"], data["indices"], shapes=shapes)
markers = tuple(data["markers"].tolist())
take = MarkerTake(markers, data["times"], data["positions"], 30.0)
setup = RetargetSetup(Binding(markers, data["vertices"]), neutral=(0, 3), nose_tip="nose")
shot, _ = usdface.assemble_shot(Rig("face", (mesh,)), take, setup=setup)
result = usdface.retarget(shot)
assert result.weights.weights.shape == (len(data["times"]), len(names))
print("LOADED", *sorted({name.partition(".")[0] for name in sys.modules}))
"""


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


@pytest.fixture(scope="module")
def folder(world: World, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = world.write(tmp_path_factory.mktemp("face"))
    files = (folder / "rig.usda", folder / "take.usda", folder / "shot.usda")
    usdface.make_shot(*files, bind=folder / "bind.json")
    return folder


@pytest.fixture(scope="module")
def shot(folder: Path) -> Shot:
    rig, _ = usdface.read_rig(folder / "rig.usda")
    take, _ = usdface.read_take(folder / "take.usda")
    setup, _ = usdface.read_bind(folder / "bind.json")
    return usdface.assemble_shot(rig, take, setup=setup)[0]


def test_an_unknown_emotion_is_refused_before_the_solve(
    shot: Shot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "usdface.shot.retarget.solve_shot", lambda *_: pytest.fail("the shot was solved")
    )
    expected = r"there is no emotion 'jy'; the shot has joy, .*; did you mean joy\?$"
    with pytest.raises(InputError, match=expected):
        usdface.retarget(shot, options=ProcessOptions(gains={"jy": 0.5}))


def test_arrays_and_files_give_the_same_weights(folder: Path, shot: Shot) -> None:
    result = usdface.retarget(shot)
    processed = usdface.process(folder / "shot.usda")
    played = animation_of(processed.written[0]).reordered(result.weights.names)
    np.testing.assert_allclose(played.weights, result.weights.weights, atol=1e-6)
    written = processed.value
    assert written.emotions.keys() == result.emotions.keys() != set()
    for name, curve in written.emotions.items():
        np.testing.assert_allclose(curve, result.emotions[name], atol=1e-6)


def _capital(name: str) -> str:
    return name[0].upper() + name[1:]


def _snake(name: str) -> str:
    return "_".join(split_words(name))


def _letter(name: str) -> str:
    return _snake(name).upper().replace("_LEFT", "_L").replace("_RIGHT", "_R")


@pytest.mark.parametrize("spell", [_capital, _snake, _letter])
def test_a_rig_in_another_spelling_gets_the_same_rules_and_weights(
    shot: Shot, spell: Callable[[str], str]
) -> None:
    """Live Link writes a capital first letter; poses, rules and terms are those of the names."""
    (mesh,) = shot.rig.meshes
    shapes = tuple(replace(shape, name=spell(shape.name)) for shape in mesh.shapes)
    rig = replace(shot.rig, meshes=(replace(mesh, shapes=shapes),))
    renamed, _ = usdface.assemble_shot(rig, shot.take, setup=shot.setup)
    assert shot.system is not None and renamed.system is not None
    assert renamed.system.fuzzy == shot.system.fuzzy
    own, other = usdface.retarget(shot), usdface.retarget(renamed)
    assert own.corrected is not None and (own.corrected - own.solved.weights).max() > 0.1
    assert [spell(name) for name in own.weights.names] == list(other.weights.names)
    np.testing.assert_allclose(other.weights.weights, own.weights.weights, atol=1e-9, rtol=0)
    for name, curve in own.emotions.items():
        np.testing.assert_allclose(other.emotions[name], curve, atol=1e-9, rtol=0)


@pytest.mark.slow
def test_no_file_format_is_loaded(world: World, tmp_path: Path) -> None:
    """A program that has arrays needs neither USD nor glTF."""
    mesh = world.rig.meshes[0]
    vertices = np.array(list(world.points.values()))
    np.savez(
        tmp_path / "world.npz",
        names=mesh.shape_names,
        offsets=mesh.offsets_at(np.arange(len(mesh.points))),
        points=mesh.points,
        counts=mesh.face_counts,
        indices=mesh.face_indices,
        markers=list(world.points),
        vertices=vertices,
        times=world.take.times,
        positions=world.take.positions,
    )
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(tmp_path / "world.npz")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    loaded = set(run.stdout.split()[1:])
    assert not loaded & {"pxr", "pygltflib", "OpenImageIO", "trimesh", "rich", "matplotlib"}


def test_the_function_has_the_name_that_a_subpackage_has() -> None:
    import usdface.retarget.solver.solve

    assert callable(usdface.retarget)
    assert sys.modules["usdface.retarget"] is not usdface.retarget


def test_what_is_not_solved_keeps_its_base(shot: Shot) -> None:
    frames = len(shot.take.times)
    tongue = np.linspace(0.0, 1.0, frames)
    base = WeightsTake(("tongueOut", "jawOpen"), shot.take.times, np.stack([tongue, tongue], 1))
    result = usdface.retarget(replace(shot, base=base))
    plain = usdface.retarget(shot)
    assert result.weights.names[:2] == ("tongueOut", "jawOpen")
    np.testing.assert_array_equal(result.weights.column("tongueOut"), tongue)
    np.testing.assert_allclose(  # sums of other lengths round otherwise
        result.weights.reordered(plain.weights.names).weights, plain.weights.weights, atol=1e-14
    )
    with pytest.raises(InputError, match="base weights have 3 frames, the take"):
        replace(shot, base=WeightsTake(("a",), np.arange(3.0), np.zeros((3, 1))))


def test_options_of_a_run_go_before_the_shot(shot: Shot) -> None:
    bare = usdface.retarget(shot, options=ProcessOptions(express=False, head=False, clean=False))
    assert bare.corrected is None and bare.trace is None and not bare.emotions
    assert bare.head_motion is None and bare.repairs == ()
    assert bare.weights is bare.solved
    with pytest.raises(InputError, match="'solve' is 'slow'; expected take, frame"):
        ProcessOptions(solve="slow")
    with pytest.raises(TypeError):
        ProcessOptions(gltf="face.glb")


def test_the_report_says_which_frames_are_neutral(shot: Shot) -> None:
    assert report_of(usdface.retarget(shot)).summary["neutral_frames"] == list(shot.setup.neutral)
    of_rig = replace(shot, setup=replace(shot.setup, neutral=None, neutral_weights={}))
    assert report_of(usdface.retarget(of_rig)).summary["neutral_frames"] == "rig"


def test_an_explanation_needs_a_trace(shot: Shot) -> None:
    from usdface.shot.explanation import explain_result

    with pytest.raises(InputError, match="no memberships"):
        explain_result(usdface.retarget(shot))
    explained = explain_result(usdface.retarget(shot, options=ProcessOptions(trace=True)))
    assert explained.frame(explained.peak)["rules"][0]["fires"] > 0
    with pytest.raises(InputError, match="no expression layer"):
        explain_result(usdface.retarget(shot, options=ProcessOptions(express=False)))


@pytest.mark.slow
def test_what_the_callback_raises_ends_the_job(folder: Path, shot: Shot) -> None:
    announced: list[str] = []

    def until(last: str, step: Step) -> None:
        announced.append(step.name)
        if step.name == last:
            raise Cancelled

    with pytest.raises(Cancelled):
        usdface.retarget(shot, on_progress=lambda step: until("solve", step))
    assert announced == ["clean", "solve"]
    steps: list[Step] = []
    usdface.retarget(shot, on_progress=steps.append)
    rounds = [step.fraction for step in steps if step.name == "solve" and step.fraction is not None]
    assert len(rounds) > 1 and rounds == sorted(rounds) and 0 <= rounds[0] < rounds[-1] < 1
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    for last in ("read", "clean", "solve", "express", "report", "gltf"):
        with pytest.raises(Cancelled):
            usdface.process(
                folder / "shot.usda",
                output=folder / "new.usda",
                gltf=folder / "new.glb",
                on_progress=lambda step, last=last: until(last, step),
            )
    after = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert after == before


@pytest.mark.slow
def test_blocks_of_frames_do_not_show(shot: Shot, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = usdface.retarget(shot)
    monkeypatch.setattr("usdface.numerics.frame_blocks.BLOCK", 7)
    again = usdface.retarget(shot)
    assert whole.trace is not None and again.trace is not None
    pairs = [(whole.weights.weights, again.weights.weights), (whole.corrected, again.corrected)]
    sides = whole.trace.sides
    pairs += [(sides[side].inputs, again.trace.sides[side].inputs) for side in sides]
    for a, b in pairs:
        np.testing.assert_allclose(b, a, atol=1e-9, rtol=0)
    assert report_of(again).details == report_of(whole).details
    assert report_of(again).verdict == report_of(whole).verdict


@pytest.mark.slow
def test_a_take_is_corrected_alike_at_any_frame_rate() -> None:
    """The example's performance without noise, sampled at 60, 120 and 240 Hz."""
    examples = Path(__file__).resolve().parents[2] / "examples"
    rig, _ = usdface.read_rig(examples / "head.usdc")
    take, _ = usdface.read_take(examples / "take.usdc")
    bind, _ = usdface.read_bind(examples / "bind.json")
    shot, _ = usdface.assemble_shot(rig, take.with_frames(slice(0, 300)), setup=bind)
    performed, vertices = usdface.retarget(shot).solved.weights, bind.binding.points
    rest, offsets = shot.mesh.points[vertices], shot.mesh.offsets_at(vertices)
    known = np.arange(300) / 60.0
    found = []
    for every in (1, 2, 4):
        times = np.arange(299 * every + 1) / (60.0 * every)
        weights = np.clip(CubicSpline(known, performed)(times), 0.0, 1.0)
        positions = rest + np.einsum("fs,smk->fmk", weights, offsets)
        sampled = MarkerTake(bind.binding.markers, times, positions, 60.0 * every)
        first, last = bind.neutral
        setup = replace(bind, head="stabilised", neutral=(first * every, last * every))
        result = usdface.retarget(replace(shot, take=sampled, setup=setup))
        solved, corrected = result.solved.weights, result.corrected
        found.append([(corrected - solved)[::every], (result.weights.weights - corrected)[::every]])
    assert np.abs(found[0][0]).max() > 0.4
    for corrections in zip(*found, strict=True):
        for faster in corrections[1:]:
            assert np.abs(faster - corrections[0]).max() < 0.03
            assert np.sqrt(((faster - corrections[0]) ** 2).mean()) < 2e-3
