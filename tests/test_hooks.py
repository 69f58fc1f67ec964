"""Hooks: what they get and return, what becomes of a failing one, and the documented package."""

import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from checkout import run_usdface
from other_packages import Install, install
from processed import digests, run, shoot
from pxr import Usd
from worlds import animation_of, make_world

from usdface.clips import Clip
from usdface.errors import InputError, PluginError
from usdface.hooks import Hook, run_hooks
from usdface.pipeline import apply, calibrate, explain, export_scene, list_plugins, process
from usdface.rigs import Rig
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["install"]

PACKAGE = Path(__file__).parents[1] / "examples" / "hook_package"
WORLD = make_world()
WEIGHTS = WeightsTake(WORLD.rig.shape_names, WORLD.take.times, WORLD.weights, WORLD.take.rate)


def hooks_of(point: str, *functions: object) -> list[Hook]:
    return [Hook(point, f"acme:{point}.{i}", f) for i, f in enumerate(functions)]  # type: ignore[arg-type]


def entries(**named: str) -> dict[str, dict[str, str]]:
    return {"usdface.hooks": named}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return shoot(WORLD.write(tmp_path_factory.mktemp("hooks")))


@pytest.fixture
def shot(written: Path, tmp_path: Path) -> Iterator[Path]:
    """The shot with its rig and take in a folder of its own."""
    folder = tmp_path / "shot"
    folder.mkdir()
    for each in written.parent.iterdir():
        (folder / each.name).write_bytes(each.read_bytes())
    yield folder / "shot.usda"


def half(weights: WeightsTake, shot: object) -> WeightsTake:
    return replace(weights, weights=0.5 * weights.weights)


def nothing(weights: WeightsTake, shot: object) -> None:
    return None


# ---------------------------------------------------------------- values


def test_each_hook_gets_the_result_of_the_one_before() -> None:
    value, findings = run_hooks(
        hooks_of("weights_solved", half, nothing, half), "weights_solved", WEIGHTS, None
    )
    np.testing.assert_array_equal(value.weights, 0.25 * WEIGHTS.weights)
    assert [(f.code, f.where) for f in findings] == [
        ("HOOK_APPLIED", "acme:weights_solved.0"),
        ("HOOK_APPLIED", "acme:weights_solved.2"),
    ]
    assert "12 of 12 blend shapes in 35 frames" in findings[0].message


def test_a_change_of_the_recorded_head_is_told() -> None:
    turns = np.outer(np.arange(len(WEIGHTS.times)) > 9, [0.0, 0.2, 0.0])
    take = replace(WEIGHTS, head=turns)

    def twice(take: WeightsTake) -> WeightsTake:
        return replace(take, head=2.0 * take.head)

    def without(take: WeightsTake) -> WeightsTake:
        return WeightsTake(take.names, take.times, 0.5 * take.weights, take.rate)

    _, findings = run_hooks(hooks_of("take_read", nothing_of, twice, without), "take_read", take)
    reported, lost = (found.message for found in findings)
    assert "the head in 30 frames, by 11.5 degrees at most" in reported
    assert "12 of 12 blend shapes" in lost and "the head left out" in lost


def nothing_of(take: WeightsTake) -> None:
    return None


def test_a_hook_of_another_point_is_not_called() -> None:
    hooks = hooks_of("weights_corrected", half)
    assert run_hooks(hooks, "weights_solved", WEIGHTS, None) == (WEIGHTS, [])


def test_there_is_no_other_point() -> None:
    with pytest.raises(InputError, match="there is no point 'weights_done'"):
        Hook("weights_done", "acme:weights_done", half)  # type: ignore[arg-type]


def test_columns_come_back_in_their_order() -> None:
    def turned(weights: WeightsTake, shot: object) -> WeightsTake:
        return weights.reordered(weights.names[::-1])

    value, findings = run_hooks(hooks_of("weights_solved", turned), "weights_solved", WEIGHTS, None)
    assert value.names == WEIGHTS.names and not findings
    np.testing.assert_array_equal(value.weights, WEIGHTS.weights)


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda w, s: w.weights, "it returned ndarray; expected WeightsTake"),
        (lambda w, s: replace(w, weights=w.weights + 1.0), "expected 0 to 1"),
        (lambda w, s: replace(w, times=w.times + 1.0), "other times"),
        (lambda w, s: w.reordered((*w.names[1:], "tail")), "other blend shapes"),
        (lambda w, s: w.weights.fill(0.0), "ValueError: assignment destination is read-only"),
        (lambda w: w, "TypeError"),
        (lambda w, s: sys.exit(3), "SystemExit: 3"),
    ],
)
def test_a_failing_hook_is_one_line_with_its_distribution(function: object, message: str) -> None:
    with pytest.raises(PluginError) as raised:
        run_hooks(hooks_of("weights_solved", function), "weights_solved", WEIGHTS, None)
    assert raised.value.code == "HOOK_FAILED"
    assert message in str(raised.value) and "\n" not in str(raised.value)
    assert "--skip-hook acme:weights_solved.0" in str(raised.value)


def test_a_take_keeps_its_kind_and_its_clock() -> None:
    hidden = WORLD.take.positions.copy()
    hidden[3:5, 2] = np.nan
    given = replace(WORLD.take, positions=hidden)
    hook = hooks_of("take_read", lambda take, shot: given)
    value, (found,) = run_hooks(hook, "take_read", WORLD.take, None)
    assert value is given
    assert "2 seen or occluded otherwise" in found.message
    with pytest.raises(PluginError, match="expected MarkerTake"):
        run_hooks(hooks_of("take_read", lambda take, shot: WEIGHTS), "take_read", WORLD.take, None)


def test_a_scene_is_a_rig_and_clips() -> None:
    def named(rig: Rig, clips: tuple[Clip, ...]) -> tuple[Rig, list[Clip]]:
        return rig, [replace(clip, name="walk") for clip in clips]

    scene = (WORLD.rig, (Clip("take", WEIGHTS),))
    (_, clips), (found,) = run_hooks(hooks_of("before_export", named), "before_export", scene)
    assert [clip.name for clip in clips] == ["walk"] and found.message.endswith("the clips")
    with pytest.raises(PluginError, match=r"expected \(rig, clips\)"):
        run_hooks(hooks_of("before_export", lambda r, c: c), "before_export", scene)


# ---------------------------------------------------------------- jobs


HALF = """
from dataclasses import replace
import numpy as np

def half(weights, shot):
    return replace(weights, weights=0.5 * weights.weights)

def fail(value, *rest):
    raise RuntimeError("no licence for this floor")
"""


@pytest.mark.slow
def test_the_layers_hold_what_the_hooks_made(install: Install, shot: Path) -> None:
    plain = process(shot)
    solved = plain.value.solved
    install("acme_half", HALF, entries(weights_solved="acme_half:half"))
    result = process(shot)
    np.testing.assert_array_equal(result.value.solved.weights, 0.5 * solved.weights)
    played = animation_of(result.written[0], muted="express.usdc").reordered(solved.names)
    np.testing.assert_allclose(played.weights, 0.5 * solved.weights, atol=1e-7)
    assert result.details["hooks"] == [
        {
            "name": "acme_half:weights_solved",
            "origin": "acme_half 1.0 (acme_half:half)",
        }
    ]
    assert "HOOK_APPLIED" in {f.code for f in result.findings}


@pytest.mark.slow
@pytest.mark.parametrize(
    "point",
    [
        "take_read",
        pytest.param("weights_solved", marks=pytest.mark.slow),
        pytest.param("weights_corrected", marks=pytest.mark.slow),
        "before_export",
    ],
)
def test_a_failing_hook_stops_the_run_and_changes_no_file(
    install: Install, shot: Path, point: str
) -> None:
    glb = shot.parent / "face.glb"
    process(shot, gltf=glb)
    before = digests(shot.parent)
    install("acme_half", HALF, entries(**{point: "acme_half:fail"}))
    with pytest.raises(PluginError) as raised:
        process(shot, gltf=glb)
    assert f"{point} of acme_half 1.0 (acme_half:fail) failed" in str(raised.value)
    assert "no licence for this floor" in str(raised.value)
    assert digests(shot.parent) == before
    process(shot, gltf=glb, skip_hooks=["acme_half"])
    assert digests(shot.parent) == before


def test_a_hook_that_cannot_be_loaded_stops_the_run(install: Install, shot: Path) -> None:
    before = digests(shot.parent)
    install("acme_half", HALF, entries(weights_solved="acme_half:missing"))
    with pytest.raises(PluginError) as raised:
        process(shot)
    assert raised.value.code == "HOOK_FAILED" and "acme_half 1.0" in str(raised.value)
    assert digests(shot.parent) == before
    result = process(shot, skip_hooks=["acme_half:weights_solved"])
    assert [f.code for f in result.findings if f.code.startswith("HOOK")] == ["HOOK_SKIPPED"]


@pytest.mark.parametrize("form", ["json", "text"])
def test_a_hook_that_prints_leaves_the_json_alone(
    install: Install, shot: Path, form: str, capfd: pytest.CaptureFixture[str]
) -> None:
    source = "def told(weights, shot):\n    print('floor 2')\n"
    install("acme_told", source, entries(weights_solved="acme_told:told"))
    run("process", shot, "--format", form)
    printed = capfd.readouterr()
    if form == "json":
        assert json.loads(printed.out)["verdict"] and "floor 2" in printed.err
    else:
        assert "floor 2" in printed.out and "verdict" in printed.out


def test_an_unknown_name_to_skip_is_an_error_before_any_work(install: Install, shot: Path) -> None:
    install("acme_half", HALF, entries(weights_solved="acme_half:half"))
    with pytest.raises(InputError, match="did you mean acme_half"):
        process(shot, skip_hooks=["acme_hlf"])


@pytest.mark.slow
def test_a_host_gets_the_same_as_the_command(install: Install, shot: Path) -> None:
    install("acme_half", HALF, entries(weights_solved="acme_half:half"))
    stage = Usd.Stage.Open(str(shot))
    stage.SetEditTarget(stage.GetSessionLayer())
    applied = apply(stage)
    written = process(shot)
    np.testing.assert_array_equal(applied.value.solved.weights, written.value.solved.weights)
    assert applied.details["hooks"] == written.details["hooks"]


@pytest.mark.slow
def test_jobs_that_read_the_take_call_its_hooks(install: Install, shot: Path) -> None:
    install("acme_half", HALF, entries(take_read="acme_half:fail"))
    for job in (lambda: explain(shot), lambda: calibrate(shot, shot.parent / "anna.json")):
        with pytest.raises(PluginError, match="no licence"):
            job()
    assert not (shot.parent / "anna.json").exists()
    calibrate(shot, shot.parent / "anna.json", skip_hooks=["acme_half"])


def test_hooks_of_one_point_run_in_the_order_of_their_names(install: Install, shot: Path) -> None:
    source = HALF + "\ndef quarter(weights, shot):\n    return half(half(weights, shot), shot)\n"
    install("zebra", source, entries(**{"weights_solved.10": "zebra:half"}))
    install("aardvark", source, entries(**{"weights_solved.20": "aardvark:quarter"}))
    result = process(shot)
    assert [each["name"] for each in result.details["hooks"]] == [
        "zebra:weights_solved.10",
        "aardvark:weights_solved.20",
    ]


# ---------------------------------------------------------------- the documented package


@pytest.fixture
def example(install: Install) -> Path:
    project = tomllib.loads((PACKAGE / "pyproject.toml").read_text())["project"]
    source = (PACKAGE / "studio_hooks.py").read_text()
    return install("studio_hooks", source, project["entry-points"])


def test_the_example_runs_at_every_point(example: Path, shot: Path) -> None:
    glb = shot.parent / "face.glb"
    result = process(shot, gltf=glb)
    applied = [f.where.partition(":")[2] for f in result.findings if f.code == "HOOK_APPLIED"]
    assert applied == ["weights_solved.10_rest", "before_export"]  # no such marker, no wide jaw
    weights = result.value.solved.weights
    assert not ((weights > 0) & (weights < 0.01)).any()
    assert re.search(rb'"name":"[A-Za-z]+_take"', glb.read_bytes())


def test_the_example_hides_a_marker_and_limits_the_jaw(example: Path) -> None:
    import studio_hooks  # type: ignore[import-not-found]

    names = ("temple_right", *WORLD.take.names[1:])
    take = studio_hooks.without_loose_markers(replace(WORLD.take, names=names), None)
    assert isinstance(take, MarkerTake)
    assert not take.visible[:, 0].any() and take.visible[:, 1:].all()
    wide = replace(WEIGHTS, weights=np.ones_like(WEIGHTS.weights))
    limited = studio_hooks.within_the_rig(wide, None)
    assert limited.column("jawOpen").max() == 0.9
    assert limited.column("eyeBlinkLeft").min() == 1.0


@pytest.mark.slow
def test_an_export_goes_through_the_hooks(example: Path, shot: Path) -> None:
    root = process(shot, skip_hooks=["studio_hooks"]).written[0]
    result = export_scene(root, shot.parent / "face.glb")
    assert [f.where for f in result.findings if f.code == "HOOK_APPLIED"] == [
        "studio_hooks:before_export"
    ]
    packed = export_scene(root, shot.parent / "face.usdz")
    assert "HOOK_SKIPPED" in {f.code for f in packed.findings}


@pytest.mark.slow
def test_the_command_line_names_and_skips_them(example: Path, shot: Path) -> None:
    """In a process of its own, as a user has it."""

    def command(*words: object) -> SimpleNamespace:
        done = run_usdface(*words, "--format", "json", folders=[example], cwd=shot.parent)
        return SimpleNamespace(code=done.returncode, **json.loads(done.stdout))

    listed = command("plugins")
    assert [(row["kind"], row["loads"]) for row in listed.plugins] == [("hook", True)] * 4
    skipped = command("process", shot, "--skip-hook", "studio_hooks")
    assert skipped.code == 0 and not hasattr(skipped, "hooks")
    assert [f["code"] for f in skipped.findings].count("HOOK_SKIPPED") == 4
    export = ("export", skipped.written[0], "-o", shot.with_name("face.glb"))
    exported = command(*export, "--skip-hook", "studio_hooks")
    codes = [f["code"] for f in exported.findings]
    assert codes.count("HOOK_SKIPPED") == 4 and "HOOK_APPLIED" not in codes


def test_a_plug_in_that_would_not_load_says_why(install: Install) -> None:
    install("acme_half", HALF, entries(weights_solved="acme_half:missing"))
    install("acme_odd", "x = 1\n", entries(at_lunch="acme_odd:x", take_read="acme_odd:x"))
    install(
        "acme_view",
        "def check():\n    return ['no display']\n",
        {"usdface.hosts": {"viewer": "acme_view:check"}, "usdface.takes": {"t": "acme_view:gone"}},
    )
    result = list_plugins()
    why = {
        row["name"]: (row["kind"], row["host"], row["why_not"]) for row in result.details["plugins"]
    }
    assert not any(row["loads"] for row in result.details["plugins"])
    assert "no attribute 'missing'" in why["acme_half:weights_solved"][2]
    assert "expected a function" in why["acme_odd:take_read"][2]
    assert "expected a function" in why["acme_odd:at_lunch"][2]
    assert why["acme_view:viewer"] == ("host", "viewer", "no display")
    assert {f.code for f in result.findings} == {"PLUGIN_FAILED"}
    run("plugins")


@pytest.mark.parametrize("host", ["usdview", "maya"])
def test_plug_ins_for_hosts_are_listed_with_their_reasons(install: Install, host: str) -> None:
    folder = Path(__file__).parents[1] / "plugins" / host
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    install(f"installed_{host}", "", project["entry-points"])
    # An install from the clone, as the pages of the hosts show it, leaves its metadata there.
    rows = list_plugins().details["plugins"]
    (row,) = (row for row in rows if row["origin"].startswith(f"installed_{host} "))
    assert (row["kind"], row["host"], row["loads"]) == ("host", host, False)
    assert "this Python has no" in row["why_not"]


@pytest.mark.slow
def test_the_example_is_installed_by_pip(tmp_path: Path) -> None:
    """Into a folder of its own, with its metadata from its pyproject.toml."""
    source = tmp_path / "package"
    source.mkdir()
    for each in PACKAGE.iterdir():
        if each.is_file():
            (source / each.name).write_bytes(each.read_bytes())
    site = tmp_path / "site"
    pip = ["python3", "-m", "pip", "install", "-q", "--no-deps", "--target", str(site), str(source)]
    subprocess.run(pip, check=True, timeout=300)
    done = run_usdface("plugins", "--format", "json", folders=[site])
    assert done.returncode == 0, done.stderr
    plugins = json.loads(done.stdout)["plugins"]
    assert [row["origin"].partition(" (")[0] for row in plugins] == ["studio-hooks 1.0"] * 4
    assert all(row["loads"] for row in plugins)
