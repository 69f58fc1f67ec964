"""A real browser opens the pages of `usdface view` from their files."""

import json
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from chromium import Browser, Page, chromium_path, open_browser
from pxr import Usd, UsdSkel

from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.cli import main
from usdface.clips import Clip
from usdface.io.gltf.image import to_png
from usdface.io.usd.rig_write import write_rig
from usdface.materials import Material, Texture
from usdface.page.character import character_data
from usdface.page.clip_data import TICKS_PER_SECOND
from usdface.page.document import page_html
from usdface.page.packed_data import Quantized
from usdface.rigs import BlendShape, Combination, Inbetween, Mesh, Rig
from usdface.takes import WeightsTake

pytestmark = pytest.mark.slow

FRAMES = [0, 72, 250, 480, 719]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    executable = chromium_path()
    if not executable or not shutil.which("bash"):
        pytest.skip("chromium is not installed; .ci/run installs it")
    with open_browser(executable) as opened:
        yield opened


@pytest.fixture(scope="module")
def page_file(example: Path) -> Path:
    html = example / "shot.html"
    assert main(["view", str(example / "shot.usdface.usda"), "-o", str(html)]) == 0
    return html


@pytest.fixture(scope="module")
def page(browser: Browser, page_file: Path) -> Page:
    return browser.page(page_file, "#frame=72")


def pixels(png: bytes) -> np.ndarray:
    """Return an image as numbers from 0 to 1."""
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        Path(file.name).write_bytes(png)
        return np.asarray(oiio.ImageBuf(file.name).get_pixels(oiio.FLOAT))


def test_it_opens_at_the_frame_of_the_address_without_any_request(page: Page) -> None:
    assert page.run("usdface.player.frame") == 72
    asked = [url for url in page.requests() if not url.startswith(("data:", "blob:"))]
    assert len(asked) == 1 and asked[0].startswith("file:///"), "only the page itself"
    assert page.problems() == []


def test_the_face_smiles(page: Page) -> None:
    pictures = []
    for frame in (0, 72):
        page.run(f"usdface.player.seek({frame})")
        pictures.append(page.canvas())
    assert len(pictures[0]) > 20_000, "an empty canvas compresses to less"
    assert pictures[0] != pictures[1]


def test_influences_are_the_weights_of_the_layers(page: Page, example: Path) -> None:
    stage = Usd.Stage.Open(str(example / "shot.usdface.usda"))
    prim = next(p for p in stage.Traverse() if p.IsA(UsdSkel.Animation))
    animation = UsdSkel.Animation(prim)
    names = list(animation.GetBlendShapesAttr().Get())
    layers = {"corrected": stage}
    layers["raw"] = Usd.Stage.Open(str(example / "shot.usdface.usda"))
    for layer in layers["raw"].GetLayerStack():
        if layer.realPath.endswith(("express.usdc", "closure.usdc")):
            layers["raw"].MuteLayer(layer.identifier)
    shapes = page.run(
        "usdface.character.parts[0].shapes.map(({ shape }) => usdface.character.shapes[shape])"
    )
    assert len(shapes) >= 50
    differ = 0.0
    for frame in FRAMES:
        page.run(f"usdface.player.seek({frame})")
        played = {}
        for name, source in layers.items():
            attribute = UsdSkel.Animation(source.GetPrimAtPath(prim.GetPath()))
            weights = attribute.GetBlendShapeWeightsAttr().Get(frame)
            expected = dict(zip(names, weights, strict=True))
            played[name] = np.array(page.run(f"usdface.influences('{name}')")[0])
            np.testing.assert_allclose(played[name], [expected[s] for s in shapes], atol=1e-3)
        differ = max(differ, float(np.abs(played["raw"] - played["corrected"]).max()))
    assert differ > 0.2, "the correction shows"


def test_raw_and_corrected_look_different_where_their_weights_do(page: Page) -> None:
    page.run("usdface.player.seek(250), usdface.switch('markers')")
    shown = {}
    for key in ("1", "2", "4", "3"):
        page.key(key)
        shown[key] = page.canvas()
    assert len(set(shown.values())) == 4
    page.run("usdface.player.seek(0)")
    page.key("1")
    raw = pixels(page.canvas())
    page.key("2")
    same = np.abs(pixels(page.canvas()) - raw).mean()
    changed = np.abs(pixels(shown["1"]) - pixels(shown["2"])).mean()
    assert 20 * same < changed, "the neutral frame is not corrected"
    page.run("usdface.switch('markers')")


def test_a_click_on_the_ribbon_goes_there(page: Page) -> None:
    box = page.run("(({ left, top, width }) => [left, top, width])(ribbon.getBoundingClientRect())")
    place = (box[0] + 0.5 * box[2], box[1] + 30)
    page.drag(place, place)
    assert page.run("usdface.player.frame") == pytest.approx(360, abs=2)
    page.wait("location.hash === '#frame=' + usdface.player.frame")
    page.key("w")
    assert page.run("usdface.worst.includes(usdface.player.frame)")


@pytest.mark.parametrize(
    ("start", "frames", "rate", "shown"),
    [
        ("01:02:03:04", 61, 25.0, "01:02:05:15"),
        ("01:00:00;00", 1799, 29.97, "01:00:59;29"),
        ("01:00:00;00", 1800, 29.97, "01:01:00;02"),  # two labels are left out each minute
        ("00:00:00;00", 17982, 29.97, "00:10:00;00"),  # but not each tenth
        ("00:00:00:00", 1800, 29.97, "00:01:00:00"),
        ("00:00:59;59", 1, 59.94, "00:01:00;04"),
    ],
)
def test_the_clock_counts_as_the_timecode(
    page: Page, start: str, frames: int, rate: float, shown: str
) -> None:
    words = f'"{start}", {frames} / {rate}, {rate}'
    assert page.run(f'import("usdface/player").then((own) => own.timecodeAt({words}))') == shown


def test_a_marker_under_the_pointer_is_named_with_its_residual(page: Page) -> None:
    page.run("usdface.player.seek(72), usdface.switch('features'), usdface.stage.draw()")
    at = page.run(
        "(() => { const at = usdface.stage.screen(usdface.features[1].points, 4);"
        "const box = usdface.stage.place.getBoundingClientRect();"
        "return [at.x + box.left, at.y + box.top]; })()"
    )
    page.call("Input.dispatchMouseEvent", type="mouseMoved", x=at[0], y=at[1])
    page.wait("!usdface.label.hidden")
    result = page.run("usdface.label.textContent")
    name, residual = page.run(
        "[usdface.page.features.names[4], usdface.page.features.residual_mm.values["
        "72 * usdface.page.features.names.length + 4]]"
    )
    assert result == f"{name}  {residual:.1f} mm"
    page.run("usdface.switch('features')")


def test_it_plays_loops_a_part_and_stops(page: Page) -> None:
    page.run("usdface.player.seek(100), usdface.player.setRange(100, 110)")
    page.key(" ")
    page.wait("usdface.player.frame > 103")
    assert page.run("usdface.player.playing && usdface.player.frame <= 110")
    page.key(" ")
    page.run("usdface.player.setRange()")
    assert not page.run("usdface.player.playing")


def test_rules_and_emotions_are_those_of_the_explanation(
    page: Page, example: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    command = ["fuzzy", "explain", str(example / "shot.usda"), "--frame", "72", "--format", "json"]
    assert main(command) == 0
    explained = json.loads(capsys.readouterr().out)
    page.run("usdface.open('expression'), usdface.player.seek(72)")
    bars = page.run(
        "Object.fromEntries([...document.querySelectorAll('.meter')].map((m) => "
        "[m.querySelector('.name').textContent, Number(m.querySelector('b').textContent)]))"
    )
    assert bars == pytest.approx(explained["emotions"], abs=0.006)
    first = explained["rules"][0]
    opened = page.run(
        "[...document.querySelector('.rule').querySelectorAll('.condition')].map((c) => "
        "['b', '.mm'].map((part) => parseFloat(c.querySelector(part).textContent)))"
    )
    expected = [[c["degree"], c["mm"]] for c in first["conditions"]]
    np.testing.assert_allclose(opened, expected, atol=0.06)
    assert page.run("document.querySelector('.rule .text').textContent") == first["rule"]


def hostile_rig() -> Rig:
    """A sheet whose names are markup, scripts and control characters."""
    points = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0.0]])
    names = [
        "</script><script>document.title='owned'</script>",
        "<img src=x onerror=\"document.title='owned'\">",
        "\u2028\"'`${document.title='owned'}\\",
        "__proto__",
    ]
    shapes = tuple(BlendShape(name, [i], [[0, 0, 0.02]]) for i, name in enumerate(names))
    return Rig(names[0], (Mesh(names[1], points, [4], [0, 1, 2, 3], shapes=shapes),))


def test_hostile_names_stay_text(browser: Browser, tmp_path: Path) -> None:
    rig = hostile_rig()
    names = rig.shape_names
    take = WeightsTake(names, [0.0, 0.5], np.eye(2, len(names)), 30.0)
    write_rig(rig, tmp_path / "rig.usda", [Clip(names[1], take)])
    html = tmp_path / "<b>&amp;'page.html"
    assert main(["view", str(tmp_path / "rig.usda"), "-o", str(html)]) == 0
    page = browser.page(html)
    assert page.run("document.title") == "rig.usda"
    page.run("usdface.open('shapes')")
    shown = page.run("[...document.querySelectorAll('.slider .name')].map((n) => n.textContent)")
    assert shown == list(names)
    assert page.run("document.querySelectorAll('img, b:empty + script').length") == 0
    assert page.problems() == []


def test_sliders_move_inbetweens_and_combinations_as_the_evaluator(
    browser: Browser, tmp_path: Path
) -> None:
    generator = np.random.default_rng(5)
    points = generator.normal(size=(12, 3)) * 0.1
    between = tuple(
        Inbetween(f"b{w}", w, generator.normal(size=(12, 3)) * 0.01) for w in (0.3, 0.7, -0.5)
    )
    every = np.arange(12)
    shapes = (
        BlendShape("jaw", every, generator.normal(size=(12, 3)) * 0.02, inbetweens=between),
        BlendShape("smile", every[:6], generator.normal(size=(6, 3)) * 0.02),
        BlendShape(
            "both",
            every[3:],
            generator.normal(size=(9, 3)) * 0.01,
            combination=Combination(("jaw", "smile")),
        ),
        BlendShape(
            "least",
            every[3:],
            generator.normal(size=(9, 3)) * 0.01,
            combination=Combination(("jaw", "smile"), "min"),
        ),
    )
    mesh = Mesh(
        "Face",
        points,
        [3] * 10,
        np.array([[i, i + 1, i + 2] for i in range(10)]).ravel(),
        shapes=shapes,
    )
    write_rig(Rig("r", (mesh,)), tmp_path / "rig.usda")
    assert main(["view", str(tmp_path / "rig.usda"), "-o", str(tmp_path / "rig.html")]) == 0
    page = browser.page(tmp_path / "rig.html")
    evaluator, _ = evaluator_of(mesh.shapes, every)
    for jaw, smile in ((0.0, 0.0), (0.15, 1.0), (0.3, 0.5), (0.5, 0.2), (0.9, 1.0), (1.0, 0.0)):
        page.run(
            f"[{jaw}, {smile}].forEach((weight, i) => {{ const row = usdface.sliders.rows[i];"
            "row.input.value = weight; row.input.dispatchEvent(new Event('input')); })"
        )
        moved = page.run(
            "Array.from(usdface.character.displacements("
            "0, usdface.sliders.weights, new Float32Array(36)))"
        )
        weights = evaluator.complete(np.array([[jaw, smile]]))
        np.testing.assert_allclose(moved, evaluator.displacements(weights)[0], atol=2e-6)


def test_a_rig_of_several_hundred_shapes_moves(browser: Browser, tmp_path: Path) -> None:
    """More shapes than a graphics card has room for as uniforms or as layers of a texture."""
    generator = np.random.default_rng(3)
    x, y = np.meshgrid(np.linspace(-0.1, 0.1, 30), np.linspace(-0.1, 0.1, 30))
    points = np.column_stack([x.ravel(), y.ravel(), 0.02 * np.cos(20 * x.ravel())])
    corner = (np.arange(29)[:, None] * 30 + np.arange(29)).ravel()
    faces = np.column_stack([corner, corner + 1, corner + 31, corner + 30])
    shapes = []
    for number in range(700):
        vertices = np.sort(generator.choice(900, 20, replace=False))
        shapes.append(BlendShape(f"s{number}", vertices, generator.normal(size=(20, 3)) * 0.01))
    mesh = Mesh("sheet", points, np.full(841, 4), faces.ravel(), shapes=tuple(shapes))
    write_rig(Rig("many", (mesh,)), tmp_path / "rig.usdc")
    html = tmp_path / "rig.html"
    assert main(["view", str(tmp_path / "rig.usdc"), "-o", str(html)]) == 0
    page = browser.page(html)
    weights = generator.uniform(size=700)
    page.run(
        f"usdface.sliders.weights = Float32Array.from({json.dumps(weights.tolist())}), "
        "usdface.stage.draw()"
    )
    shown = page.run(
        "Array.from(usdface.figures.corrected.meshes[0].geometry.attributes.position.array)"
    )
    moved = points + np.tensordot(weights, mesh.offsets_at(np.arange(900)), 1)
    np.testing.assert_allclose(np.reshape(shown, (-1, 3)), moved, atol=2e-4)
    assert page.problems() == []


def test_a_texture_is_shown_where_its_coordinates_say(browser: Browser, tmp_path: Path) -> None:
    image = np.zeros((8, 8, 3), np.uint8)
    image[:4, :4], image[4:, 4:] = (255, 0, 0), (0, 0, 255)  # top left, bottom right
    image[:4, 4:], image[4:, :4] = (0, 255, 0), (255, 255, 255)
    points = [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]]
    uvs = [[0, 0], [1, 0], [1, 1], [0, 1]]
    (tmp_path / "skin.png").write_bytes(to_png(image))
    texture = Texture(str(tmp_path / "skin.png"), suffix=".png")
    material = Material("skin", (1.0, 1.0, 1.0), base_color_texture=texture)
    shape = BlendShape("smile", [0, 1, 2, 3], np.full((4, 3), 0.001))
    mesh = Mesh("m", points, [4], range(4), uvs=uvs, shapes=(shape,), material="skin")
    write_rig(Rig("r", (mesh,), materials=(material,)), tmp_path / "rig.usda")
    assert main(["view", str(tmp_path / "rig.usda"), "-o", str(tmp_path / "rig.html")]) == 0
    page = browser.page(tmp_path / "rig.html")
    page.wait("usdface.character.materials.some((m) => m.map?.image?.width)")
    shown = pixels(page.canvas())[..., :3]
    lit = np.argwhere(np.ptp(shown, axis=2) > 0.3)
    (top, left), (bottom, right) = lit.min(axis=0), lit.max(axis=0)
    for (y, x), colour in (((0.25, 0.25), 0), ((0.75, 0.75), 2), ((0.25, 0.75), 1)):
        at = shown[int(top + y * (bottom - top)), int(left + x * (right - left))]
        assert at.argmax() == colour, (y, x)
    assert page.problems() == []


def test_a_verdict_is_shown_with_its_reasons(browser: Browser, tmp_path: Path) -> None:
    rig = hostile_rig()
    times = np.arange(3) * TICKS_PER_SECOND
    weights = {"corrected": Quantized(np.eye(3, 4))}
    clip = {"name": "take", "rate": 1.0, "ticks": times, "weights": weights, "joints": None}
    reason = {"message": "<b>chin</b> is off", "remedy": "usdface bind", "frames": [2, 2]}
    verdict = {"level": "look_at", "reasons": [reason]}
    data = {"clips": [clip], "character": character_data(rig, rig.meshes), "verdict": verdict}
    (tmp_path / "a.html").write_text(page_html("view", "a", "", data), encoding="utf-8")
    page = browser.page(tmp_path / "a.html")
    result = "document.getElementById('verdict').innerText"
    assert page.run(result).lower().strip() == "look at (1)"  # the reasons would hide the face
    page.run("document.querySelector('#verdict summary').click()")
    assert reason["message"] in page.run(result)
    page.run("document.querySelector('#verdict button').click()")
    assert page.run("usdface.player.frame") == 2 and page.problems() == []
