"""The committed example: a head that is a face, and a take that is known to the last weight."""

import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))  # the examples are no part of the installed package

from examples import head, make_example, performance, rings, sculpt, shapes, topology  # noqa: E402
from examples.expressions import EMOTIONS  # noqa: E402
from usdface.figures import render  # noqa: E402
from usdface.geometry.triangulation import triangle_fans  # noqa: E402
from usdface.io.bind_file import bind_json, read_bind  # noqa: E402
from usdface.io.takes.trc import read_trc  # noqa: E402
from usdface.io.usd.rig import read_rig  # noqa: E402

FLIP = np.array([-1, 1, 1])
MM = 1e-3


@pytest.fixture(scope="module")
def rig():
    return head.build_head()


@pytest.fixture(scope="module")
def base():
    return topology.build()


@pytest.fixture(scope="module")
def moves(base):
    return shapes.head_shapes(base)


@pytest.fixture(scope="module")
def mouth(base):
    """Vertices of the lips' rims: upper lip, and below each the one of the lower lip."""
    rim = base.mouth[rings.SOCK_RINGS]
    half = len(rim) // 2
    return rim[: half + 1], rim[np.r_[0, np.arange(len(rim) - 1, half - 1, -1)]]


@pytest.fixture(scope="module")
def lids(base):
    """Vertices of the left lids' rims: upper, and below each the one of the lower lid."""
    rim = base.eyes[0][rings.POCKET_RINGS]
    half = len(rim) // 2
    return rim[: half + 1], rim[np.r_[0, np.arange(len(rim) - 1, half - 1, -1)]]


@pytest.mark.slow
def test_the_rig_has_the_52_shapes_and_each_moves_something(rig):
    assert sorted(rig.shape_names) == sorted(shapes.ARKIT_NAMES)
    assert len(shapes.ARKIT_NAMES) == 52
    for name in shapes.ARKIT_NAMES:
        largest = max(
            np.abs(s.offsets).max() for mesh in rig.meshes for s in mesh.shapes if s.name == name
        )
        assert 1 * MM < largest < 60 * MM, name


@pytest.mark.slow
def test_the_neutral_head_is_its_own_mirror_image(base):
    np.testing.assert_array_equal(base.points[base.mirror] * FLIP, base.points)
    np.testing.assert_array_equal(base.mirror[base.mirror], np.arange(len(base.points)))


@pytest.mark.slow
@pytest.mark.parametrize("name", shapes.ARKIT_NAMES)
def test_right_mirrors_left_and_the_others_mirror_themselves(name, moves, base):
    swap = {"Left": "Right", "Right": "Left"}
    side = next((s for s in swap if name.endswith(s)), "")
    twin = name.removesuffix(side) + swap.get(side, "")
    np.testing.assert_allclose(
        moves[twin][base.mirror] * FLIP, moves[name], rtol=0, atol=1e-12, err_msg=name
    )


@pytest.mark.slow
def test_brows_and_eyes_are_mirror_images_with_their_shapes(rig):
    for part in ("brow", "eye"):
        left, right = rig.mesh(f"{part}_left"), rig.mesh(f"{part}_right")
        np.testing.assert_array_equal(left.points * FLIP, right.points)
        swap = {"Left": "Right", "Right": "Left"}
        mirrored = {s.name: s for s in right.shapes}
        for shape in left.shapes:
            side = next((s for s in swap if shape.name.endswith(s)), "")
            twin = mirrored[shape.name.removesuffix(side) + swap.get(side, "")]
            np.testing.assert_array_equal(shape.offsets * FLIP, twin.offsets)


@pytest.mark.slow
def test_lips_touch_at_neutral_and_part_with_the_jaw_while_the_upper_lip_stays(base, moves, mouth):
    upper, lower = mouth
    np.testing.assert_allclose(base.points[upper], base.points[lower], rtol=0, atol=1e-9)
    opened = base.points + moves["jawOpen"]
    middle = len(upper) // 2
    assert np.linalg.norm(opened[upper[middle]] - opened[lower[middle]]) > 20 * MM
    centre = slice(middle - 4, middle + 5)
    # The mouth narrows a little as it opens, but the upper lip does not go down with the jaw.
    assert np.abs(moves["jawOpen"][upper[centre], 1:]).max() < 0.1 * MM


@pytest.mark.slow
def test_mouth_close_shuts_the_lips_of_an_open_jaw_and_leaves_the_chin(base, moves, mouth):
    upper, lower = mouth
    closed = base.points + moves["jawOpen"] + moves["mouthClose"]
    assert np.linalg.norm(closed[upper] - closed[lower], axis=1).max() < 0.5 * MM
    chin = np.argmin(np.linalg.norm(base.points - (0, -0.105, 0.075), axis=1))
    assert moves["jawOpen"][chin, 1] < -15 * MM
    assert np.linalg.norm(moves["mouthClose"][chin]) < 1 * MM


@pytest.mark.slow
def test_a_blink_closes_the_lids_outside_the_eyeball_all_the_way(base, moves, lids):
    upper, lower = lids
    assert np.linalg.norm(base.points[upper] - base.points[lower], axis=1).max() > 15 * MM
    shut = base.points + moves["eyeBlinkLeft"]
    assert np.linalg.norm(shut[upper] - shut[lower], axis=1).max() < 0.5 * MM
    lid = np.unique(base.eyes[0][rings.POCKET_RINGS : rings.POCKET_RINGS + 4])
    for weight in np.linspace(0, 1, 11):
        away = np.linalg.norm(
            base.points[lid] + weight * moves["eyeBlinkLeft"][lid] - sculpt.EYE, axis=1
        )
        assert away.min() > sculpt.EYE_RADIUS


@pytest.mark.slow
def test_each_side_of_the_face_keeps_to_itself(base, moves):
    right_half = base.points[:, 0] < -0.02
    for name in ("browDownLeft", "eyeBlinkLeft", "cheekSquintLeft", "mouthSmileLeft"):
        left = np.abs(moves[name][~right_half]).max()
        assert np.abs(moves[name][right_half]).max() < 0.05 * left, name


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "place", "towards"),
    [
        ("mouthSmileLeft", (0.026, -0.065, 0.080), (1, 1, 0)),
        ("mouthFrownLeft", (0.026, -0.065, 0.080), (0, -1, 0)),
        ("mouthLeft", (0.0, -0.062, 0.091), (1, 0, 0)),
        ("mouthRight", (0.0, -0.062, 0.091), (-1, 0, 0)),
        ("mouthPucker", (0.0, -0.062, 0.091), (0, 0, 1)),
        ("jawForward", (0.0, -0.097, 0.085), (0, 0, 1)),
        ("jawLeft", (0.0, -0.097, 0.085), (1, 0, 0)),
        ("browInnerUp", (0.015, 0.034, 0.082), (0, 1, 0)),
        ("browDownRight", (-0.015, 0.034, 0.082), (1, -1, 0)),
        ("cheekPuff", (0.047, -0.058, 0.068), (1, 0, 1)),
        ("noseSneerLeft", (0.0135, -0.038, 0.096), (0, 1, 0)),
        ("mouthRollUpper", (0.0, -0.0665, 0.088), (0, 0, -1)),
    ],
)
def test_shapes_move_where_apple_says(name, place, towards, base, moves):
    vertex = np.argmin(np.linalg.norm(base.points - place, axis=1))
    move = moves[name][vertex]
    for value, sign in zip(move, towards, strict=True):
        if sign:
            assert value * sign > 0.8 * MM


@pytest.mark.slow
def test_normals_point_outwards(rig, base):
    for mesh in rig.meshes:
        triangles = mesh.face_indices[triangle_fans(mesh.face_counts)[0]]
        a, b, c = np.moveaxis(mesh.points[triangles], 1, 0)
        assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0, mesh.name
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-9)
    outside = np.ones(len(base.points), dtype=bool)
    outside[base.mouth[: rings.SOCK_RINGS + 2]] = False
    for eye in base.eyes:
        outside[eye[: rings.POCKET_RINGS + 2]] = False
    outside[np.argsort(base.points[:, 1])[:100]] = False  # the neck's open rim
    normals = rig.mesh("head").normals[: len(base.points)][outside]
    slope = sculpt.gradient(base.points[outside])
    slope /= np.linalg.norm(slope, axis=1, keepdims=True)
    assert (np.einsum("ij,ij->i", normals, slope) > 0.5).mean() > 0.995


@pytest.mark.slow
def test_the_six_emotions_are_poses_of_the_rig(rig):
    assert list(EMOTIONS) == ["joy", "sadness", "anger", "fear", "disgust", "surprise"]
    for pose in EMOTIONS.values():
        assert set(pose) <= set(rig.shape_names)
        assert all(0 < weight <= 1 for weight in pose.values())


def test_the_take_is_neutral_first_then_shows_each_emotion_under_expressively():
    performed = performance.perform()
    first, last = performance.NEUTRAL
    assert not performed.weights.weights[first : last + 1].any()
    peaks = performed.amounts.max(axis=0)
    assert (peaks > 0.59).all() and (peaks < 0.71).all()
    assert (np.diff(performed.amounts.argmax(axis=0)) > 60).all()
    assert 0.001 < (~performed.take.visible).mean() < 0.02
    noise_free = np.abs(performed.clean - performed.clean[0])[first : last + 1]
    assert noise_free.max() == 0


def test_markers_sit_on_separate_mirrored_vertices(base):
    bound = performance.binding()
    assert len(set(bound.points.tolist())) == len(bound.markers) == 42
    place = dict(zip(bound.markers, bound.points, strict=True))
    for marker, vertex in place.items():
        assert (
            base.mirror[vertex]
            == place[
                marker.replace("left", "RIGHT").replace("right", "left").replace("RIGHT", "right")
            ]
        ), marker


def test_the_committed_files_are_what_the_generator_writes(tmp_path):
    make_example.make_sources(tmp_path)
    folder = ROOT / "examples"
    # What the committed binding does not name has its default.
    setups = [read_bind(place / "bind.json")[0] for place in (folder, tmp_path)]
    assert bind_json(setups[0]) == bind_json(setups[1])
    # Numbers, not bytes: another processor may round a hundredth of a millimetre otherwise.
    takes = [read_trc(place / "performance.trc")[0] for place in (folder, tmp_path)]
    assert takes[0].names == takes[1].names
    np.testing.assert_allclose(takes[0].positions, takes[1].positions, rtol=0, atol=1.1e-5)
    committed, _ = read_rig(folder / "head.usdc")
    made, _ = read_rig(tmp_path / "head.usdc")
    assert committed.shape_names == made.shape_names
    for a, b in zip(committed.meshes, made.meshes, strict=True):
        np.testing.assert_array_equal(a.face_indices, b.face_indices)
        np.testing.assert_allclose(a.points, b.points, rtol=0, atol=1e-7)
        for s, t in zip(a.shapes, b.shapes, strict=True):
            np.testing.assert_allclose(s.offsets, t.offsets, rtol=0, atol=1e-6)


@pytest.mark.slow
def test_a_second_run_makes_the_same(moves):
    performance.perform.cache_clear()
    head.build_head.cache_clear()
    again = shapes.head_shapes(topology.build())
    for name, offsets in moves.items():
        np.testing.assert_array_equal(again[name], offsets)
    np.testing.assert_array_equal(
        performance.perform().take.positions, performance.perform.__wrapped__().take.positions
    )


def test_the_take_reads_back_as_performed():
    take, findings = read_trc(ROOT / "examples" / "performance.trc")
    performed = performance.perform().take
    assert take.names == performed.names and take.rate == 60
    np.testing.assert_array_equal(take.visible, performed.visible)
    np.testing.assert_allclose(take.positions, performed.positions, rtol=0, atol=6e-6)
    assert {f.severity for f in findings} == {"info"}


def test_the_renderer_draws_the_nearest_triangle_and_the_background():
    points = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0], [-1, -1, -1], [1, -1, -1], [0, 1, -1]])
    triangles = np.array([[3, 4, 5], [0, 1, 2]])
    colors = np.array([[0, 1.0, 0], [1.0, 0, 0]])
    view = render.View(centre=(0, 0, 0), height=3, size=(40, 30), background=(0, 0, 1), samples=1)
    image = render.render(points.astype(float), triangles, colors, view).astype(int)
    assert image.shape == (30, 40, 3)
    assert image[15, 20, 0] > 100 and image[15, 20, 1] < 20
    assert tuple(image[0, 0]) == (0, 0, 255)
    np.testing.assert_allclose(image, image[:, ::-1], atol=90)  # lit from one side, same form
    assert ((image[..., 2] == 255) == (image[:, ::-1, 2] == 255)).mean() > 0.98


def test_nothing_of_the_example_is_too_large():
    names = ("head.usdc", "performance.trc", "bind.json")
    assert sum((ROOT / "examples" / name).stat().st_size for name in names) < 1.6e6
