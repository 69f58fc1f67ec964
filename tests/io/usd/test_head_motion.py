"""The head's motion on the stage, on the SkelRoot or on the joint that carries the face."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from clips import evaluate_gltf
from processed import shoot
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel
from scipy.spatial.transform import Rotation
from worlds import World, animation_of, make_world, restaged

from usdface.cli import main
from usdface.geometry.rigid_fit import similarity_fit
from usdface.io.usd.evaluate import evaluate_usd
from usdface.io.usd.take_write import write_take
from usdface.options import ProcessOptions
from usdface.pipeline import apply, process
from usdface.rigs import Skeleton, Skin
from usdface.takes import WeightsTake

_OP = "xformOp:transform:usdfaceHead"
FEATURES = "usdface:featurePoints"

# A skeleton, the single joint that a rig gets, and a character without skin.
KINDS = ["joints", pytest.param("one joint", marks=pytest.mark.slow), "no joint"]


def processed(
    folder: Path,
    *flags: str,
    world: World | None = None,
    unit: tuple[float, str] = (1.0, "Y"),
    skinned: bool = True,
    turned: float = 0.0,
    **bind: object,
) -> Usd.Stage | None:
    (world or make_world()).write(folder, **bind)
    if unit != (1.0, "Y"):
        restaged(folder / "rig.usda", *unit)
    if not skinned:
        unskinned(folder / "rig.usda")
    if turned:
        rig = Usd.Stage.Open(str(folder / "rig.usda"))
        UsdGeom.Xformable(skel_root(rig)).AddRotateYOp().Set(turned)
        rig.Save()
    names = {name: str(folder / f"{name}.usda") for name in ("rig", "take", "shot")}
    shot = ["--rig", names["rig"], "--take", names["take"], "--bind", str(folder / "bind.json")]
    assert main(["shot", *shot, "-o", names["shot"]]) == 0
    assert main(["process", names["shot"], "--no-express", *flags]) == 0
    return Usd.Stage.Open(str(folder / "shot.usdface.usda"))


def unskinned(path: Path) -> None:
    """Take the joint away that the rig's writer binds a face to that has no skeleton."""
    stage = Usd.Stage.Open(str(path))
    for prim in stage.Traverse():
        for name in ("jointIndices", "jointWeights"):
            prim.RemoveProperty(f"primvars:skel:{name}")
    stage.Save()


def skel_root(stage: Usd.Stage) -> Usd.Prim:
    return next(prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root))


def to_world(prim: Usd.Prim, code: float) -> np.ndarray:
    return np.array(UsdGeom.XformCache(code).GetLocalToWorldTransform(prim))


@pytest.mark.parametrize("unit", [(0.01, "Z"), pytest.param((1.0, "Y"), marks=pytest.mark.slow)])
def test_the_character_moves_with_the_markers(tmp_path: Path, unit: tuple[float, str]) -> None:
    """The performer is the character: its face, moved, is where the markers are."""
    stage = processed(tmp_path, unit=unit, skinned=False)
    root, take = skel_root(stage), stage.GetPrimAtPath("/Shot/Capture/Take")
    solved = stage.GetPrimAtPath("/Shot/Retarget")
    rest = np.linalg.inv(to_world(root, Usd.TimeCode.Default()))
    furthest = 0.0
    for code in take.GetAttribute("points").GetTimeSamples():
        face = np.array(solved.GetAttribute(FEATURES).Get(code))
        moved = face @ rest[:3, :3] + rest[3, :3]
        there = to_world(root, code)
        moved = moved @ there[:3, :3] + there[3, :3]
        place = to_world(take, code)
        markers = np.array(take.GetAttribute("points").Get(code)) @ place[:3, :3] + place[3, :3]
        np.testing.assert_allclose(moved * unit[0], markers * unit[0], atol=2e-5)
        furthest = max(furthest, float(np.abs(moved - face).max()) * unit[0])
    assert furthest > 0.008


@pytest.mark.slow
def test_a_character_that_stands_elsewhere_keeps_its_own_transform(tmp_path: Path) -> None:
    stage = processed(tmp_path, skinned=False)
    prims = UsdGeom.Xformable(skel_root(stage)).GetXformOpOrderAttr()
    assert list(prims.Get()) == [_OP]
    rig = Usd.Stage.Open(str(tmp_path / "rig.usda"))
    UsdGeom.Xformable(skel_root(rig)).AddTranslateOp().Set((1.0, 2.0, 3.0))
    rig.Save()
    assert main(["process", str(tmp_path / "shot.usda"), "--no-express"]) == 0
    again = Usd.Stage.Open(str(tmp_path / "shot.usdface.usda"))
    root = skel_root(again)
    order = UsdGeom.Xformable(root).GetXformOpOrderAttr().Get()
    assert list(order) == ["xformOp:translate", _OP]
    np.testing.assert_allclose(to_world(root, 0.0)[3, :3], [1.0, 2.0, 3.0], atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [40.0, 180.0])
def test_a_character_that_is_turned_moves_in_its_own_space(tmp_path: Path, degrees: float) -> None:
    """Weights as if it looked ahead; the head nods where the character looks."""
    ahead = processed(tmp_path / "ahead", skinned=False)
    report = tmp_path / "report.json"
    flags = ("--report", str(report))
    turned = processed(tmp_path / "turned", *flags, skinned=False, turned=degrees)
    found = json.loads(report.read_text())["findings"]
    (result,) = (each for each in found if each["code"] == "CHARACTER_TURNED")
    assert result["values"] == {"turned_degrees": pytest.approx(degrees)}
    matrix = Rotation.from_euler("y", degrees, degrees=True).as_matrix().T
    codes = ahead.GetPrimAtPath("/Shot/Capture/Take").GetAttribute("points").GetTimeSamples()
    for code in codes[::5]:
        placed, turned_back = to_world(skel_root(ahead), code), to_world(skel_root(turned), code)
        np.testing.assert_allclose(turned_back[:3, :3], placed[:3, :3] @ matrix, atol=1e-5)
        np.testing.assert_allclose(turned_back[3, :3], placed[3, :3] @ matrix, atol=1e-5)
        points = [
            np.array(stage.GetPrimAtPath("/Shot/Retarget").GetAttribute(FEATURES).Get(code))
            for stage in (ahead, turned)
        ]
        np.testing.assert_allclose(points[1], points[0] @ matrix, atol=1e-5)
    weights = [animation_of(stage).weights for stage in (ahead, turned)]
    np.testing.assert_allclose(*weights, atol=1e-5)


@pytest.mark.parametrize("kind", ["joints", "one joint", "no joint"])
@pytest.mark.parametrize(("unit", "turned"), [((0.01, "Z"), 0), ((1.0, "Y"), 0), ((1.0, "Y"), 90)])
def test_the_head_of_a_phone_turns_the_face(
    tmp_path: Path, unit: tuple[float, str], turned: float, kind: str
) -> None:
    """About the axes of the character, whatever side it looks to."""
    world = jointed(make_world()) if kind == "joints" else make_world()
    world.write(tmp_path)
    (tmp_path / "bind.json").unlink()
    if unit != (1.0, "Y"):
        restaged(tmp_path / "rig.usda", *unit)
    if kind == "no joint":
        unskinned(tmp_path / "rig.usda")
    if turned:
        rig = Usd.Stage.Open(str(tmp_path / "rig.usda"))
        UsdGeom.Xformable(skel_root(rig)).AddRotateYOp().Set(turned)
        rig.Save()
    side = Rotation.from_euler("y", turned, degrees=True).as_matrix()
    times = world.take.times
    turns = np.outer(np.linspace(0.1, 0.7, len(times)), [0.3, 1.0, -0.2])
    take = WeightsTake(world.rig.shape_names, times, world.weights, world.take.rate, head=turns)
    write_take(take, tmp_path / "take.usda")
    names = {name: str(tmp_path / f"{name}.usda") for name in ("rig", "take", "shot")}
    assert main(["shot", "--rig", names["rig"], "--take", names["take"], "-o", names["shot"]]) == 0
    points = []
    for flags in ((), ("--no-head",)):
        assert main(["process", names["shot"], "--no-closure", *flags]) == 0
        points.append(shown(Usd.Stage.Open(str(tmp_path / "shot.usdface.usda"))))
    moved, still = points
    np.testing.assert_allclose(moved[0], still[0], atol=1e-5)
    for frame in (13, 39):
        linear, _ = similarity_fit(still[frame], moved[frame])
        turn = side @ Rotation.from_rotvec(turns[frame] - turns[0]).as_matrix() @ side.T
        np.testing.assert_allclose(linear, turn.T, atol=1e-4)


def test_muted_it_stands_still_again(tmp_path: Path) -> None:
    stage = processed(tmp_path, skinned=False)
    solve = next(x for x in stage.GetUsedLayers() if x.realPath.endswith("solve.usdc"))
    stage.MuteLayer(solve.identifier)
    np.testing.assert_array_equal(to_world(skel_root(stage), 20.0), np.eye(4))


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_gltf_shows_the_head_moving(tmp_path: Path, kind: str) -> None:
    """Brought back to USD it shows what the result shows; written beside or exported."""
    world = jointed(make_world()) if kind == "joints" else make_world()
    gltf = ("--gltf", str(tmp_path / "a.glb"))
    stage = processed(tmp_path, *gltf, world=world, skinned=kind != "no joint")
    expected = shown(stage)
    assert np.abs(expected[20:] - expected[0]).max() > 0.01
    files = ["a.glb"]
    if kind != "no joint":
        result = str(tmp_path / "shot.usdface.usda")
        assert main(["export", result, "-o", str(tmp_path / "b.glb")]) == 0
        files.append("b.glb")
    for name in files:
        assert main(["import", str(tmp_path / name), "-o", str(tmp_path / "back.usda")]) == 0
        back = Usd.Stage.Open(str(tmp_path / "back.usda"))
        clock = back.GetTimeCodesPerSecond()
        found = evaluate_usd(back)[0].points_at(world.take.times * clock)
        np.testing.assert_allclose(found, expected, atol=2e-6)


@pytest.mark.slow
def test_the_head_stays_where_it_is_told_to(tmp_path: Path) -> None:
    for folder, flags, bind in (
        ("flag", ("--no-head",), {}),
        ("bind", (), {"move_head": False}),
        ("still", (), {"head": "stabilised"}),
    ):
        stage = processed(tmp_path / folder, *flags, **bind)
        root = skel_root(stage)
        assert not root.HasAttribute(_OP)
        assert not UsdGeom.Xformable(root).TransformMightBeTimeVarying()


# A skeleton that carries the face

NECK = ((0.0, -0.12, -0.02), (0.05, 0.0, 0.0))
HEAD = ((0.0, 0.06, 0.0), (0.0, 0.1, -0.05))


def _placed(rotation: tuple[float, ...], translation: tuple[float, ...]) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(rotation).as_matrix().T
    matrix[3, :3] = translation
    return matrix


def jointed(world: World) -> World:
    """The world's face on root, neck and head; the jaw has a joint of its own."""
    joints = ("root", "root/neck", "root/neck/head", "root/neck/head/jaw")
    rest = np.array(
        [
            np.eye(4),
            _placed(NECK[1], NECK[0]),
            _placed(HEAD[1], HEAD[0]),
            _placed((0, 0, 0), (0, 0, 0.02)),
        ]
    )
    bind = [rest[0]]
    for local in rest[1:]:
        bind.append(local @ bind[-1])
    skeleton = Skeleton(joints, ("Root", "Neck", "Head", "Jaw"), np.array(bind), rest)
    face = world.rig.meshes[0]
    low = np.clip(-face.points[:, 1] / 0.11, 0.0, 1.0)
    skin = Skin(np.tile([2, 3], (len(low), 1)), np.stack([1 - low, low], 1))
    return replace(
        world, rig=replace(world.rig, meshes=(replace(face, skin=skin),), skeleton=skeleton)
    )


def shown(stage: Usd.Stage) -> np.ndarray:
    """The face as UsdSkel shows it at the take's frames [m]: (F, V, 3)."""
    return evaluate_usd(stage)[0].points_at(np.arange(40.0))


def _lines(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return capsys.readouterr().out.splitlines()


def moving_joints(stage: Usd.Stage) -> list[str]:
    animation = UsdSkel.Animation(next(p for p in stage.Traverse() if p.IsA(UsdSkel.Animation)))
    turns = [animation.GetRotationsAttr().Get(code) for code in range(40)]
    moved = np.ptp([[[*q.imaginary, q.real] for q in row] for row in turns], axis=0).max(axis=1)
    return [str(n) for n, m in zip(animation.GetJointsAttr().Get(), moved, strict=True) if m > 1e-3]


@pytest.mark.parametrize("unit", [(0.01, "Z"), pytest.param((1.0, "Y"), marks=pytest.mark.slow)])
def test_the_joint_that_carries_the_face_moves_it(tmp_path: Path, unit: tuple[float, str]) -> None:
    """UsdSkel is the judge: performer and character are one, so markers lie on the skin."""
    world = jointed(make_world())
    stage = processed(tmp_path, world=world, unit=unit)
    assert not skel_root(stage).HasAttribute(_OP)
    points = shown(stage)
    at = list(world.points.values())
    np.testing.assert_allclose(points[:, at], world.take.positions, atol=2e-5)
    still = shown(processed(tmp_path / "still", "--no-head", world=world, unit=unit))
    assert np.abs(points - still).max() > 0.01
    assert moving_joints(stage) == ["root/neck/head"]


def test_a_named_joint_moves_instead(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    world = jointed(make_world())
    stage = processed(tmp_path, world=world, head_joint="Neck")
    assert any(line.split() == ["head", "carrier", "root/neck"] for line in _lines(capsys))
    assert moving_joints(stage) == ["root/neck"]
    at = list(world.points.values())
    np.testing.assert_allclose(shown(stage)[:, at], world.take.positions, atol=2e-5)


def test_a_joint_that_is_not_there_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    world = jointed(make_world())
    processed(tmp_path, world=world, head_joint="Neck")
    shot = tmp_path / "shot.usda"
    shot.write_text(shot.read_text().replace('"Neck"', '"Tail"'))
    capsys.readouterr()
    assert main(["process", str(shot), "--no-express"]) == 1
    assert "no joints named 'Tail'" in capsys.readouterr().err
    # A shot of such a binding is not written.
    shot.unlink()
    world.write(tmp_path, head_joint="Tail")
    names = [str(tmp_path / name) for name in ("rig.usda", "take.usda", "bind.json")]
    words = [
        word for pair in zip(("--rig", "--take", "--bind"), names, strict=True) for word in pair
    ]
    assert main(["shot", *words, "-o", str(shot)]) == 1
    assert "no joints named 'Tail'" in capsys.readouterr().err and not shot.exists()


def nod(path: Path) -> None:
    """Give the rig's neck an animation of its own."""
    rig = Usd.Stage.Open(str(path))
    prim = next(p for p in rig.Traverse() if p.IsA(UsdSkel.Animation))
    animation = UsdSkel.Animation(prim)
    animation.GetJointsAttr().Set(["root/neck"])
    for code in (0.0, 39.0):
        turn = Rotation.from_rotvec([NECK[1][0] + 0.01 * code, 0, 0]).as_quat()
        animation.CreateTranslationsAttr().Set([NECK[0]], code)
        animation.CreateRotationsAttr().Set([Gf.Quatf(turn[3], *turn[:3].tolist())], code)
        animation.CreateScalesAttr().Set([(1, 1, 1)], code)
    rig.Save()


@pytest.mark.slow
def test_joints_that_are_animated_go_on_moving(tmp_path: Path) -> None:
    """The neck nods by an animation of the rig's own; the head moves on it."""
    world = jointed(make_world())
    processed(tmp_path, world=world)
    nod(tmp_path / "rig.usda")
    bare = Usd.Stage.Open(str(tmp_path / "shot.usda"))
    nodding = shown(bare)
    assert main(["process", str(tmp_path / "shot.usda"), "--no-express"]) == 0
    found = shown(Usd.Stage.Open(str(tmp_path / "shot.usdface.usda")))
    # In the frame of the neck as it nods, the skin is where the markers are.
    at = list(world.points.values())
    face = world.rig.meshes[0].points
    for frame in (0, 10, 39):
        (turn, offset), markers = _rigid(face, nodding[frame]), world.take.positions[frame]
        np.testing.assert_allclose(found[frame, at], markers @ turn + offset, atol=3e-5)
    assert np.abs(nodding[39] - face).max() > 0.01


@pytest.mark.parametrize("clock", [1.0, 2.0])
def test_a_body_goes_on_moving_beyond_the_take(tmp_path: Path, clock: float) -> None:
    """By the joints' own samples, on a layer of the stage's clock or of another one."""
    jointed(make_world()).write(tmp_path)
    rig = Usd.Stage.Open(str(tmp_path / "rig.usda"))
    rig.SetTimeCodesPerSecond(30)  # the take's
    animation = UsdSkel.Animation(next(p for p in rig.Traverse() if p.IsA(UsdSkel.Animation)))
    animation.GetJointsAttr().Set(["root/neck"])
    animation.CreateTranslationsAttr([NECK[0]])
    animation.CreateScalesAttr([(1, 1, 1)])
    turns = {code: Gf.Quatf(Gf.Rotation((1, 0, 0), code).GetQuat()) for code in (-30, 0, 39, 90)}
    for code, turn in turns.items():
        animation.CreateRotationsAttr().Set([turn], code)
    rig.Save()
    stage = Usd.Stage.Open(str(shoot(tmp_path)))
    over = Sdf.Layer.CreateAnonymous(".usda")
    over.timeCodesPerSecond = clock * stage.GetTimeCodesPerSecond()
    stage.GetRootLayer().subLayerPaths.insert(0, over.identifier)
    stage.SetEditTarget(stage.GetEditTargetForLocalLayer(over))
    for _ in range(2):
        apply(stage, options=ProcessOptions(express=False))
        played = UsdSkel.Animation(next(p for p in stage.Traverse() if p.IsA(UsdSkel.Animation)))
        names, rotations = list(played.GetJointsAttr().Get()), played.GetRotationsAttr()
        neck, head = names.index("root/neck"), names.index("root/neck/head")
        for code, turn in turns.items():
            assert Gf.Dot(rotations.Get(code)[neck], turn) == pytest.approx(1.0, abs=1e-6)
            held = rotations.Get(float(np.clip(code, 0, 39)))[head]
            assert rotations.Get(code)[head] == held


def _rigid(source: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    linear, offset = similarity_fit(source, target)
    return linear, offset


@pytest.mark.slow
def test_muted_or_again_the_joint_is_as_it_was(tmp_path: Path) -> None:
    world = jointed(make_world())
    stage = processed(tmp_path, world=world)
    layer = tmp_path / "shot.usdface" / "solve.usdc"
    before = layer.read_bytes()
    solve = next(x for x in stage.GetUsedLayers() if x.realPath.endswith("solve.usdc"))
    stage.MuteLayer(solve.identifier)
    face = world.rig.meshes[0].points
    np.testing.assert_allclose(shown(stage), np.broadcast_to(face, (40, *face.shape)), atol=1e-6)
    assert main(["process", str(tmp_path / "shot.usda"), "--no-express"]) == 0
    assert layer.read_bytes() == before


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_host_sees_the_head_move_and_may_apply_again(tmp_path: Path, kind: str) -> None:
    world = jointed(make_world()) if kind == "joints" else make_world()
    done = processed(tmp_path, world=world, skinned=kind != "no joint")
    result = shown(done)
    stage = Usd.Stage.Open(str(tmp_path / "shot.usda"))
    stage.SetEditTarget(stage.GetSessionLayer())
    for _ in range(2):
        apply(stage, options=ProcessOptions(express=False))
        np.testing.assert_allclose(shown(stage), result, atol=1e-6)


@pytest.mark.slow
def test_a_layer_of_another_clock_gets_the_joints_of_its_moments(tmp_path: Path) -> None:
    world = jointed(make_world())
    processed(tmp_path, world=world)
    nod(tmp_path / "rig.usda")
    assert main(["process", str(tmp_path / "shot.usda"), "--no-express"]) == 0
    result = shown(Usd.Stage.Open(str(tmp_path / "shot.usdface.usda")))
    stage = Usd.Stage.Open(str(tmp_path / "shot.usda"))
    over = Sdf.Layer.CreateAnonymous(".usda")
    over.timeCodesPerSecond = 2.0 * stage.GetTimeCodesPerSecond()
    stage.GetRootLayer().subLayerPaths.insert(0, over.identifier)
    stage.SetEditTarget(stage.GetEditTargetForLocalLayer(over))
    apply(stage, options=ProcessOptions(express=False))
    np.testing.assert_allclose(shown(stage), result, atol=1e-5)


@pytest.mark.parametrize(("flags", "turned"), [((), 0), (("--no-head",), 0), ((), 90)])
def test_gltf_keeps_joints_that_are_animated(
    tmp_path: Path, flags: tuple[str, ...], turned: float
) -> None:
    """Written beside the result it moves as the result; one that looks aside looks ahead."""
    world = jointed(make_world())
    world.write(tmp_path)
    nod(tmp_path / "rig.usda")
    if turned:
        rig = Usd.Stage.Open(str(tmp_path / "rig.usda"))
        UsdGeom.Xformable(skel_root(rig)).AddRotateYOp().Set(turned)
        rig.Save()
    shot, gltf, report = shoot(tmp_path), tmp_path / "face.glb", tmp_path / "report.json"
    command = ["process", shot, "--no-express", "--gltf", gltf, "--report", report, *flags]
    assert main([str(word) for word in command]) == 0
    expected = shown(Usd.Stage.Open(str(tmp_path / "shot.usdface.usda")))
    expected = expected @ Rotation.from_euler("y", -turned, degrees=True).as_matrix().T
    (face,) = evaluate_gltf(gltf)
    np.testing.assert_allclose(face.points_at(world.take.times), expected, atol=2e-6)
    assert np.abs(expected[39] - expected[0]).max() > 0.01
    found = json.loads(report.read_text())["findings"]
    assert not [each for each in found if each["code"] == "ANIMATION_DROPPED"]


@pytest.mark.parametrize("skinned", [True, False])
def test_gltf_reports_motion_that_it_leaves_out(tmp_path: Path, skinned: bool) -> None:
    """Of the character as a whole; of joints where a joint for the whole head replaces them."""
    jointed(make_world()).write(tmp_path)
    nod(tmp_path / "rig.usda")
    rig = Usd.Stage.Open(str(tmp_path / "rig.usda"))
    walk = UsdGeom.Xformable(skel_root(rig)).AddTranslateOp()
    for code in (0.0, 39.0):
        walk.Set((0.01 * code, 0, 0), code)
    rig.Save()
    if not skinned:
        unskinned(tmp_path / "rig.usda")
    found = process(shoot(tmp_path), gltf=tmp_path / "face.glb").findings
    dropped = {each.where for each in found if each.code == "ANIMATION_DROPPED"}
    joints = set() if skinned else {"/Shot/Character/Face/Anim"}
    assert dropped == {"/Shot/Character/Face"} | joints
