"""A real browser places markers on the page of `usdface bind`, and `usdface shot` takes them."""

import json
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bind_hand import place_of, saved, select
from chromium import Browser, Page, chromium_path, open_browser
from worlds import World, make_world

from usdface.cli import main
from usdface.io.bind_file import read_bind
from usdface.io.usd.stage import open_stage
from usdface.pipeline import make_shot

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def downloads(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("downloads")


@pytest.fixture(scope="module")
def browser(downloads: Path) -> Iterator[Browser]:
    executable = chromium_path()
    if not executable or not shutil.which("bash"):
        pytest.skip("chromium is not installed; .ci/run installs it")
    with open_browser(executable, downloads) as opened:
        yield opened


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


@pytest.fixture(scope="module")
def folder(world: World, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Rig, take and a binding; one marker is unsure, one has no place."""
    folder = tmp_path_factory.mktemp("bind")
    markers = {name: {"point": point} for name, point in world.points.items()}
    unsure = {"chin": {**markers.pop("chin"), "confidence": 0.31}}
    del markers["forehead"]
    markers["brow_mid_l"]["confidence"] = 0.93
    return world.write(folder, markers=markers, unsure=unsure, solve={"smoothness": 2.0})


@pytest.fixture
def page(browser: Browser, folder: Path) -> Page:
    html = folder / "bind.html"
    files = {name: str(folder / f"{name}.usda") for name in ("rig", "take")}
    bind = str(folder / "bind.json")
    command = ["bind", files["rig"], "--take", files["take"], "--bind", bind, "-o", str(html)]
    assert main(command) == 0
    return browser.page(html)


def test_it_asks_for_nothing_and_saves_the_binding_as_it_was(
    page: Page, folder: Path, downloads: Path
) -> None:
    asked = [url for url in page.requests() if not url.startswith(("data:", "blob:"))]
    assert len(asked) == 1 and page.problems() == []
    before, after = (read_bind(f)[0] for f in (folder / "bind.json", saved(page, downloads)))
    assert dict(zip(after.binding.markers, after.binding.points.tolist(), strict=True)) == dict(
        zip(before.binding.markers, before.binding.points.tolist(), strict=True)
    )
    assert after.unsure.markers == before.unsure.markers == ("chin",)
    assert (after.neutral, after.nose_tip, after.solve) == (
        before.neutral,
        before.nose_tip,
        before.solve,
    )


def test_a_dragged_marker_moves_and_the_shot_takes_it(
    page: Page, world: World, folder: Path, downloads: Path
) -> None:
    start = place_of(page, "cheek_l")
    end = place_of(page, "corner_l")
    page.drag(start, ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2))
    document = saved(page, downloads)
    setup = read_bind(document)[0]
    points = dict(zip(setup.binding.markers, setup.binding.points.tolist(), strict=True))
    moved = points.pop("cheek_l")
    assert moved != world.points["cheek_l"]
    assert all(points[name] == world.points[name] for name in points), "no other has moved"
    mesh = world.rig.meshes[0]
    middle = (mesh.points[world.points["cheek_l"]] + mesh.points[world.points["corner_l"]]) / 2
    assert np.linalg.norm(mesh.points[moved] - middle) < 0.012
    shot = folder / "shot.usda"
    made = make_shot(folder / "rig.usda", folder / "take.usda", shot, bind=document)
    assert made.value.face.vertex_of["cheek_l"] == moved
    stage = open_stage(shot)
    (prim,) = (p for p in stage.Traverse() if p.GetTypeName() == "UsdFaceRetarget")
    bound = prim.GetAttribute("usdface:bind:markers").Get()
    assert prim.GetAttribute("usdface:bind:points").Get()[list(bound).index("cheek_l")] == moved


def test_a_click_places_what_has_no_place_and_undo_takes_it_back(
    page: Page, world: World, downloads: Path
) -> None:
    select(page, "forehead")
    brow, bridge = place_of(page, "brow"), place_of(page, "bridge")
    place = (brow[0] + 25, brow[1] - abs(bridge[1] - brow[1]) * 0.5 - 25)
    page.drag(place, place)
    first = json.loads(saved(page, downloads).read_text())
    assert "forehead" in first["markers"]
    page.run("usdface.undo()")
    assert "forehead" not in json.loads(saved(page, downloads).read_text())["markers"]


def test_keys_accept_leave_out_and_mark_nose_and_neutral(page: Page, downloads: Path) -> None:
    assert page.run("usdface.page.markers[usdface.selected].name") == "chin", "unsure ones first"
    page.key("Enter")
    select(page, "jaw_r")
    page.key("Delete")
    select(page, "bridge")
    page.key("t")
    page.run("usdface.player.seek(3)")
    page.key("i")
    page.run("usdface.player.seek(9)")
    page.key("o")
    setup = read_bind(saved(page, downloads))[0]
    assert "chin" in setup.binding.markers and not setup.unsure.markers
    assert "jaw_r" not in setup.binding.markers
    assert (setup.nose_tip, setup.neutral) == ("bridge", (3, 9))


def test_one_side_is_mirrored_to_the_other(page: Page, world: World, downloads: Path) -> None:
    mesh = world.rig.meshes[0]
    wrong = int(np.abs(mesh.points - (-0.02, 0.0, 0.05)).sum(axis=1).argmin())
    page.run(
        "usdface.change((places) => places.put("
        f"usdface.page.markers.findIndex(({{ name }}) => name === 'corner_r'), {wrong}))"
    )
    page.run(
        "[...document.querySelectorAll('button')]"
        ".find((b) => b.textContent === 'left → right').click()"
    )
    setup = read_bind(saved(page, downloads))[0]
    points = dict(zip(setup.binding.markers, setup.binding.points.tolist(), strict=True))
    for name, point in points.items():
        other = name[:-1] + {"l": "r", "r": "l"}.get(name[-1], name[-1])
        if name.endswith(("_l", "_r")) and other in points:
            image = mesh.points[points[other]] * (-1, 1, 1)
            assert np.linalg.norm(mesh.points[point] - image) < 1e-3, name


def test_hostile_marker_names_stay_text(
    browser: Browser, world: World, downloads: Path, tmp_path: Path
) -> None:
    names = list(world.take.names)
    hostile = [
        "</script><script>document.title='owned'</script>",
        "<img src=x onerror=\"document.title='owned'\">",
        "\"'`${document.title='owned'}\\",
        "__proto__",
    ]
    points = {(hostile[i] if i < 4 else n): world.points[n] for i, n in enumerate(names)}
    take = replace(world.take, names=tuple(points))
    other = replace(world, points=points, take=take)
    other.write(tmp_path, nose_tip=hostile[0])
    files = {name: str(tmp_path / f"{name}.usda") for name in ("rig", "take")}
    bind, html = str(tmp_path / "bind.json"), tmp_path / "bind.html"
    command = ["bind", files["rig"], "--take", files["take"], "--bind", bind, "-o", str(html)]
    assert main(command) == 0
    page = browser.page(html)
    assert page.run("document.title") == "rig.usda: places of the markers"
    shown = page.run("[...document.querySelectorAll('.place .name')].map((n) => n.textContent)")
    assert set(shown) == set(points)
    assert page.problems() == []
    setup = read_bind(saved(page, downloads))[0]
    assert dict(zip(setup.binding.markers, setup.binding.points.tolist(), strict=True)) == points
    assert setup.nose_tip == hostile[0]
