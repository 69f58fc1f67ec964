"""Takes that leave something open, through `process`: a code, and never NaN in a layer."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd
from worlds import World, animation_of, make_world, write_live_link

from usdface.cli import main
from usdface.options import ProcessOptions
from usdface.shot.retarget import retarget
from usdface.shot.shot import Shot
from usdface.takes import MarkerTake

FACE = ("nose", "bridge", "forehead", "brow", "chin")


def processed(folder: Path, *flags: str) -> tuple[Path, dict[str, str]]:
    """Make the shot of a folder and process it; return the result and its codes."""
    files = [str(folder / f"{name}.usda") for name in ("rig", "take", "shot")]
    bind = ["--bind", str(folder / "bind.json")] if (folder / "bind.json").exists() else []
    assert main(["shot", "--rig", files[0], "--take", files[1], *bind, "-o", files[2]]) == 0
    report = folder / "report.json"
    assert main(["process", files[2], "--report", str(report), *flags]) == 0
    findings = json.loads(report.read_text())["findings"]
    return folder / "shot.usdface.usda", {f["code"]: f["severity"] for f in findings}


def numbers(value: object) -> np.ndarray:
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError):  # tokens; quaternions
        return np.array([[*q.imaginary, q.real] for q in value if hasattr(q, "imaginary")])


def check_layers(folder: Path) -> None:
    """Every number in every layer is finite, every weight within the rig's range."""
    seen = 0
    for path in sorted((folder / "shot.usdface").iterdir()):
        layer = Sdf.Layer.FindOrOpen(str(path))
        found: list[Sdf.Path] = []
        layer.Traverse("/", found.append)
        for place in found:
            for code in layer.ListTimeSamplesForPath(place) if place.IsPropertyPath() else ():
                values = numbers(layer.QueryTimeSample(place, code))
                assert np.isfinite(values).all(), (place, code)
                if place.name == "blendShapeWeights":
                    assert values.min() >= 0.0 and values.max() <= 1.0
                seen += values.size
    assert seen


def taken(world: World, positions: np.ndarray, times: np.ndarray | None = None) -> World:
    take = world.take
    times = take.times[: len(positions)] if times is None else times
    return replace(world, take=MarkerTake(take.names, times, positions, take.rate, source="t.trc"))


@pytest.mark.parametrize("mode", ["take", pytest.param("frame", marks=pytest.mark.slow)])
@pytest.mark.parametrize("lost", [slice(15, 25), slice(30, 40)])
def test_every_marker_lost_for_a_stretch(tmp_path: Path, lost: slice, mode: str) -> None:
    world = make_world()
    positions = world.take.positions.copy()
    positions[lost] = np.nan
    taken(world, positions).write(tmp_path)
    root, codes = processed(tmp_path, "--no-express", "--solve", mode)
    assert codes["FRAME_UNSOLVED"] == "warning"
    check_layers(tmp_path)
    kept = np.ones(40, dtype=bool)
    kept[lost] = False
    played = animation_of(root).reordered(world.rig.shape_names).weights
    np.testing.assert_allclose(played[kept], world.weights[kept], atol=1e-3)


@pytest.mark.parametrize(
    "left",
    [
        ("corner_l",),
        pytest.param(("corner_l", "brow_in_r"), marks=pytest.mark.slow),
        ("chin", "bridge"),
    ],
)
def test_markers_that_show_no_pose_of_the_head_tell_nothing(
    tmp_path: Path, left: tuple[str, ...]
) -> None:
    """Two markers of a head that moves on would be taken for an expression."""
    world = make_world()
    positions = world.take.positions.copy()
    lost = [k for k, name in enumerate(world.take.names) if name not in left]
    positions[np.ix_(range(8, 20), lost)] = np.nan
    taken(world, positions).write(tmp_path)
    root, codes = processed(tmp_path, "--no-express")
    assert {"FRAME_UNSOLVED", "HEAD_MARKERS_FEW"} <= codes.keys()
    check_layers(tmp_path)
    kept = np.r_[0:7, 21:40]
    played = animation_of(root).reordered(world.rig.shape_names).weights
    np.testing.assert_allclose(played[kept], world.weights[kept], atol=1e-3)
    assert np.abs(np.diff(played[7:21], axis=0)).max() < 0.3


def test_a_take_in_which_nothing_moves(tmp_path: Path) -> None:
    world = make_world()
    taken(world, np.repeat(world.take.positions[:1], 40, axis=0)).write(tmp_path)
    root, codes = processed(tmp_path)
    assert codes["TAKE_STILL"] == "warning"
    check_layers(tmp_path)
    assert np.abs(animation_of(root).weights).max() < 1e-4


@pytest.mark.slow
def test_fewer_markers_than_shapes(tmp_path: Path) -> None:
    world = make_world()
    few = replace(world, points={name: world.points[name] for name in FACE})
    few.write(tmp_path)
    root, codes = processed(tmp_path)
    assert codes["MARKERS_FEW"] == "warning"
    check_layers(tmp_path)
    jaw = animation_of(root, muted="express.usdc").column("jawOpen")
    true = world.weights[:, world.rig.shape_names.index("jawOpen")]
    assert np.corrcoef(jaw, true)[0, 1] > 0.9  # what they do show is there


def test_enough_markers_are_not_called_few(tmp_path: Path) -> None:
    make_world().write(tmp_path)
    _, codes = processed(tmp_path, "--no-express")
    assert not {"MARKERS_FEW", "TAKE_STILL", "HEAD_MARKERS_IN_LINE", "FRAME_UNSOLVED"} & set(codes)


def test_head_markers_in_a_line(tmp_path: Path) -> None:
    """A rod on the head says nothing of a turn about itself: the face decides."""
    rod = np.array([0.0, 0.15, 0.05]) + np.outer([-1.0, 0.0, 1.0], [0.05, 0.0, 0.0])
    world = with_head_markers(make_world(), rod)
    world.write(tmp_path, head=["head_0", "head_1", "head_2"])
    root, codes = processed(tmp_path, "--no-express")
    assert codes["HEAD_MARKERS_IN_LINE"] == "warning"
    check_layers(tmp_path)
    played = animation_of(root).reordered(world.rig.shape_names).weights
    np.testing.assert_allclose(played, world.weights, atol=1e-3)


@pytest.mark.slow
def test_head_markers_hidden_for_a_stretch(tmp_path: Path) -> None:
    """The head goes on: the others tell where they are, as long as they are fewer than three."""
    band = [[-0.07, 0.15, 0.05], [0.07, 0.15, 0.05], [0.0, 0.18, 0.03], [0.0, 0.15, 0.09]]
    world = with_head_markers(make_world(), np.array(band))
    positions = world.take.positions.copy()
    positions[15:25, -2:] = np.nan
    taken(world, positions).write(tmp_path, head=[f"head_{i}" for i in range(4)])
    root, codes = processed(tmp_path, "--no-express")
    assert "HEAD_MARKERS_FEW" not in codes
    check_layers(tmp_path)
    played = animation_of(root).reordered(world.rig.shape_names).weights
    assert np.sqrt(np.mean((played - world.weights) ** 2)) < 0.05  # 0.14 with the nearest pose


def with_head_markers(world: World, places: np.ndarray) -> World:
    """Return a world with markers head_0, head_1, ... on its head, at rest at (M, 3) [m]."""
    still = make_world(head_moves=False).take.positions[0]
    base = [world.take.names.index(n) for n in ("nose", "temple_l", "temple_r", "forehead")]
    pose = [_rigid(still[base], now[base]) for now in world.take.positions]
    moved = np.array([places @ turn + offset for turn, offset in pose])
    names = (*world.take.names, *(f"head_{i}" for i in range(len(places))))
    positions = np.concatenate([world.take.positions, moved], axis=1)
    take = MarkerTake(names, world.take.times, positions, world.take.rate, source="t.trc")
    return replace(world, take=take)


def _rigid(source: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    from usdface.geometry.rigid_fit import rigid_fit

    pose, _ = rigid_fit(source, target[None])
    return pose.rotations[0].T, pose.translations[0]


@pytest.mark.parametrize(
    "frames",
    [1, pytest.param(2, marks=pytest.mark.slow), 3, pytest.param(5, marks=pytest.mark.slow)],
)
def test_a_take_shorter_than_any_filter(tmp_path: Path, frames: int) -> None:
    world = make_world()
    part = slice(20, 20 + frames)
    noisy = world.take.positions + 2e-4 * np.random.default_rng(1).standard_normal(
        world.take.positions.shape
    )
    taken(world, noisy[part]).write(tmp_path, neutral="rig")
    root, codes = processed(tmp_path)
    assert codes["CLEANUP_SKIPPED"] == "info"
    check_layers(tmp_path)
    played = animation_of(root, muted="express.usdc").reordered(world.rig.shape_names).weights
    assert len(played) == frames
    # Without time to smooth over, the noise of 0.2 mm is all in the weights.
    assert np.sqrt(np.mean((played - world.weights[part]) ** 2)) < 0.1


def test_recorded_weights_out_of_range(tmp_path: Path) -> None:
    world = make_world()
    wild = world.weights.copy()
    wild[10, 0], wild[12, 3] = 1.4, -0.3
    world = replace(world, weights=wild)
    world.write(tmp_path)
    (tmp_path / "bind.json").unlink()
    write_live_link(world, tmp_path / "phone.csv")
    assert main(["take", str(tmp_path / "phone.csv"), "-o", str(tmp_path / "take.usda")]) == 0
    root, codes = processed(tmp_path)
    assert codes["WEIGHTS_CLIPPED"] == "warning"
    check_layers(tmp_path)
    played = animation_of(root)
    assert played.column("jawOpen")[10] == 1.0 and played.column("mouthFrownLeft")[12] == 0.0


@pytest.mark.slow
def test_an_image_has_no_say_on_depth(tmp_path: Path) -> None:
    """A shape that only moves along the view is not used, whatever the pixels say."""
    from worlds import camera_pixels

    world = make_world(head_moves=False)
    mesh = world.rig.meshes[0]
    forward = replace(
        mesh.shapes[0], name="jawForward", offsets=mesh.shapes[0].offsets * [0.0, 0.0, -1.0]
    )
    deep = replace(mesh, shapes=(*mesh.shapes, forward))
    pixels = camera_pixels(world.take)
    noisy = pixels.positions + 0.3 * np.random.default_rng(2).standard_normal(
        pixels.positions.shape
    )
    flat = replace(pixels, positions=noisy)
    replace(world, rig=replace(world.rig, meshes=(deep,)), take=flat).write(tmp_path)
    root, codes = processed(tmp_path, "--no-express")
    check_layers(tmp_path)
    assert np.abs(animation_of(root).column("jawForward")).max() < 1e-6
    assert "SHAPE_UNSEEN" in codes
    stage = Usd.Stage.Open(str(root))
    animation = next(p for p in stage.Traverse() if p.GetTypeName() == "SkelAnimation")
    turns = animation.GetAttribute("rotations")
    real = [turns.Get(code)[0].GetReal() for code in turns.GetTimeSamples()]
    assert np.degrees(2 * np.arccos(np.clip(real, -1, 1))).max() < 0.5  # nor turns the head


def test_a_head_that_its_markers_do_not_determine_is_known_where_the_face_is_seen() -> None:
    """Hidden head markers in a line are no gap of the head's motion."""
    rod = np.array([0.0, 0.15, 0.05]) + np.outer([-1.0, 0.0, 1.0], [0.05, 0.0, 0.0])
    world = with_head_markers(make_world(), rod)
    positions = world.take.positions.copy()
    positions[10:30, -3:] = np.nan
    setup = world.setup(head="markers", head_markers=("head_0", "head_1", "head_2"), neutral=(0, 3))
    shot = Shot(world.rig, taken(world, positions).take, setup)
    result = retarget(shot, options=ProcessOptions(express=False))
    assert result.solution is not None and result.head_motion is not None
    assert result.solution.head == "solve"
    apart = result.head_motion.rotations - result.solution.pose.rotations
    assert np.abs(apart).max() < 1e-3
