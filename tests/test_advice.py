from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from processed import digests
from pxr import Sdf
from worlds import make_world

from usdface.advice import advice
from usdface.options import ProcessOptions
from usdface.pipeline import make_shot, process
from usdface.retarget import solve_report
from usdface.rigs import BlendShape
from usdface.schemas import tokens
from usdface.shot import report as shot_report
from usdface.shot import retarget as retarget_shot

SOLVE = "shot.usdface/solve.usdc"


def fail(*_: object, **__: object) -> object:
    raise MemoryError("no room\nfor advice")


def overflow() -> np.ndarray:
    return np.array([1e300]) * 1e300


@pytest.mark.usefixtures("as_users_have_it")
@pytest.mark.parametrize(("give", "why"), [(fail, "MemoryError"), (overflow, "overflow")])
def test_advice_that_fails_is_a_finding_of_one_line(give: Callable[[], object], why: str) -> None:
    answer, (found,) = advice("next markers", give, None)
    assert answer is None
    assert (found.code, found.where, found.severity) == ("ADVICE_FAILED", "next markers", "info")
    assert why in found.message and "\n" not in found.message


def test_what_does_not_fail_is_given() -> None:
    assert advice("a sum", lambda: 1 + 1, 0) == (2, [])


def test_here_it_fails_aloud() -> None:
    with pytest.raises(MemoryError):
        advice("next markers", fail, None)


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_world().write(tmp_path_factory.mktemp("advice"))
    files = [folder / name for name in ("rig.usda", "take.usda", "bind.json", "shot.usda")]
    make_shot(*files[:2], files[3], bind=files[2])
    return files[-1]


@pytest.mark.slow
@pytest.mark.usefixtures("as_users_have_it")
@pytest.mark.parametrize(
    ("module", "name", "what"),
    [
        (shot_report, "free_places", "next markers"),
        (solve_report, "region_errors", "residual"),
        (solve_report, "confidence_of", "confidence"),
        pytest.param(solve_report, "places_of", "confidence", marks=pytest.mark.slow),
    ],
)
def test_a_result_is_the_same_but_for_the_advice_that_fails(
    shot: Path, monkeypatch: pytest.MonkeyPatch, module: object, name: str, what: str
) -> None:
    process(shot)
    before = digests(shot.parent), without_deviations(shot.parent)
    monkeypatch.setattr(module, name, fail)
    result = process(shot)
    assert [f.where for f in result.findings if f.code == "ADVICE_FAILED"] == [what]
    after = digests(shot.parent), without_deviations(shot.parent)
    if what == "confidence":  # the deviations that the solve layer keeps are part of it
        assert before[0].pop(SOLVE) != after[0].pop(SOLVE)
    assert after == before


def without_deviations(folder: Path) -> str:
    """Return the text of the solve layer without the deviations of the weights."""
    text = Sdf.Layer.FindOrOpen(str(folder / SOLVE))
    text.Reload(force=True)
    lines = text.ExportToString().splitlines()
    kept = (tokens.SOLVED_SHAPES, tokens.SOLVED_DEVIATIONS, "fingerprint")
    return "\n".join(line for line in lines if not any(f" {name} =" in line for name in kept))


@pytest.mark.usefixtures("as_users_have_it")
def test_without_the_regions_the_rest_is_written(
    shot: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(retarget_shot, "region_residuals", fail)
    result = process(shot, options=ProcessOptions(express=False))
    assert "ADVICE_FAILED" in {f.code for f in result.findings}
    assert all(path.is_file() for path in result.written)


@pytest.mark.slow
@pytest.mark.parametrize("far", [0.55, pytest.param(100.0, marks=pytest.mark.slow), 1e20])
def test_one_vertex_of_one_shape_far_off_ends_no_job(tmp_path: Path, far: float) -> None:
    world = make_world()
    (mesh,) = world.rig.meshes
    offsets = mesh.offsets_at(np.arange(len(mesh.points)))[0]
    offsets[next(v for v in range(80, 195) if v not in world.points.values())] += far
    shapes = (BlendShape.from_dense(mesh.shapes[0].name, offsets), *mesh.shapes[1:])
    rig = replace(world.rig, meshes=(replace(mesh, shapes=shapes),))
    folder = replace(world, rig=rig).write(tmp_path)
    files = [folder / name for name in ("rig.usda", "take.usda", "bind.json", "shot.usda")]
    make_shot(*files[:2], files[3], bind=files[2])
    result = process(files[-1])
    assert "next_markers" in result.summary
    assert "ADVICE_FAILED" not in {f.code for f in result.findings}
