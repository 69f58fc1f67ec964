"""Inbetweens and combination shapes through the files: what the rig declares is solved."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from curved_world import COMBINED, make_curved_world
from pxr import Usd, UsdSkel
from worlds import World, animation_of

from usdface.cli import main
from usdface.errors import InputError
from usdface.io.rigs.combinations import read_combinations
from usdface.io.usd.evaluate import evaluate_usd
from usdface.io.usd.rig import read_rig
from usdface.rigs import Combination, Rig


@pytest.fixture(scope="module")
def world() -> World:
    return make_curved_world()


def processed(world: World, folder: Path, *flags: str) -> tuple[Path, set[str]]:
    world.write(folder)
    files = [str(folder / f"{name}.usda") for name in ("rig", "take", "shot")]
    made = ["--rig", files[0], "--take", files[1], "--bind", str(folder / "bind.json")]
    assert main(["shot", *made, "-o", files[2]]) == 0
    report = folder / "report.json"
    assert main(["process", files[2], "--report", str(report), *flags]) == 0
    findings = json.loads(report.read_text())["findings"]
    return folder / "shot.usdface.usda", {finding["code"] for finding in findings}


@pytest.mark.slow
def test_process_gives_the_weights_back(world: World, tmp_path: Path) -> None:
    root, codes = processed(world, tmp_path)
    assert not codes & {"INBETWEEN_IGNORED", "COMBINATION_IGNORED"}
    played = animation_of(root, muted="express.usdc").reordered(world.rig.shape_names)
    assert np.abs(played.weights - world.weights).max() < 1e-3
    # UsdSkel is the judge: the skin is where the markers were.
    at = list(world.points.values())
    stage = Usd.Stage.Open(str(root))
    express = next(x for x in stage.GetUsedLayers() if x.realPath.endswith("express.usdc"))
    stage.MuteLayer(express.identifier)
    shown = evaluate_usd(stage)[0].points_at(np.arange(40.0))[:, at]
    np.testing.assert_allclose(shown, world.take.positions, atol=2e-5)


@pytest.mark.slow
def test_expressions_take_combinations_along(world: World, tmp_path: Path) -> None:
    root, _ = processed(world, tmp_path)
    final, solved = animation_of(root), animation_of(root, muted="express.usdc")
    assert np.abs(final.weights - solved.weights).max() > 0.05
    for name, combination in COMBINED.items():
        parents = [final.column(parent) for parent in combination.of]
        made = np.min(parents, axis=0) if combination.rule == "min" else np.prod(parents, axis=0)
        np.testing.assert_allclose(final.column(name), made, atol=1e-6)


@pytest.mark.slow
def test_a_limit_is_never_passed(world: World, tmp_path: Path) -> None:
    """Declared the other way round than it was performed, the brow stays below its limit."""
    limit = Combination(("browDownLeft",), "limit")
    mesh = world.rig.meshes[0]
    shapes = tuple(
        replace(s, combination=limit) if s.name == "browInnerUp" else s for s in mesh.shapes
    )
    limited = replace(world, rig=replace(world.rig, meshes=(replace(mesh, shapes=shapes),)))
    below, above = (world.weights[:, mesh.shape_names.index(n)] for n in ("browInnerUp", *limit.of))
    assert (below - above).max() > 0.1
    root, _ = processed(limited, tmp_path, "--no-express")
    played = animation_of(root)
    assert (played.column("browInnerUp") - played.column("browDownLeft")).max() < 1e-6


@pytest.mark.slow
def test_what_a_rig_declares_survives_usd(world: World, tmp_path: Path) -> None:
    world.write(tmp_path)
    back, findings = read_rig(tmp_path / "rig.usda")
    found = {s.name: s.combination for s in back.meshes[0].shapes if s.combination}
    assert found == COMBINED and not findings
    stage = Usd.Stage.Open(str(tmp_path / "rig.usda"))
    prim = next(p for p in stage.Traverse() if p.GetName() == "browsWorried")
    assert UsdSkel.BlendShape(prim)
    prim.GetAttribute("usdface:combination:rule").Set("sum")
    stage.Save()
    back, findings = read_rig(tmp_path / "rig.usda")
    assert [f.code for f in findings] == ["COMBINATION_IGNORED"] and "'sum'" in findings[0].message


def bare(world: World) -> Rig:
    mesh = world.rig.meshes[0]
    shapes = tuple(replace(s, combination=None) for s in mesh.shapes)
    return replace(world.rig, meshes=(replace(mesh, shapes=shapes),))


@pytest.mark.slow
def test_a_folder_declares_them_in_a_file(world: World, tmp_path: Path) -> None:
    declared = {name: list(c.of) for name, c in COMBINED.items() if c.rule == "product"}
    declared |= {"browsWorried": {"of": ["browDownLeft", "browInnerUp"], "rule": "min"}}
    declared |= {"nobody": ["jawOpen"]}
    declaration = tmp_path / "combinations.json"
    # With the byte order mark of some editors.
    declaration.write_text(json.dumps(declared), encoding="utf-8-sig")
    rig, findings = read_combinations(tmp_path, bare(world))
    assert {s.name: s.combination for s in rig.meshes[0].shapes if s.combination} == COMBINED
    assert [(f.code, f.where) for f in findings] == [("SHAPE_UNKNOWN", "nobody")]


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "{",
        '{"a": ["b"], "a": ["c"]}',
        '{"a": []}',
        '{"a": 3}',
        '{"a": {"of": ["b"], "rule": "sum"}}',
        '{"a": {"x": 1}}',
    ],
)
def test_a_file_that_makes_no_sense_is_refused(world: World, tmp_path: Path, text: str) -> None:
    (tmp_path / "combinations.json").write_text(text)
    with pytest.raises(InputError, match=r"combinations\.json"):
        read_combinations(tmp_path, bare(world))
