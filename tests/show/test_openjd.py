"""The bundle of a sequence: valid, and run for real it gives the bytes of `usdface sequence`."""

import json
import shutil
import sys
from pathlib import Path

import pytest
from openjd_program import openjd
from processed import digests
from worlds import make_world

from usdface.errors import InputError
from usdface.pipeline import process_sequence
from usdface.pipeline.farm_jobs import write_sequence_job

SHOW = """
folder = "shots"
[characters.mia]
rig = "rig.usda"
bind = "bind.json"
"""
SHOT = '[[shots]]\nname = "{name}"\ntake = "take.usda"\ncharacter = "mia"\ngain = {gain}\n'
SHOTS = [("a", 1.0), ("b", 0.5), ("c", 0.2), ("d", 0.0)]


@pytest.fixture
def show(tmp_path: Path) -> Path:
    folder = make_world().write(tmp_path / "show")
    shots = "".join(SHOT.format(name=name, gain=gain) for name, gain in SHOTS)
    (folder / "show.toml").write_text(SHOW + shots)
    return folder / "show.toml"


def test_the_bundle_names_all_that_a_farm_must_know(show: Path, tmp_path: Path) -> None:
    result = write_sequence_job(show, tmp_path / "job", chunk=3, skip_hooks=["studio-hooks"])
    assert result.summary["tasks"] == 2 and result.summary["shots"] == 4
    bundle = {path.stem: json.loads(path.read_text()) for path in result.written}
    process, table = bundle["template"]["steps"]
    (shots,) = process["parameterSpace"]["taskParameterDefinitions"]
    assert (shots["type"], shots["range"]) == ("CHUNK[INT]", "{{Param.Indices}}")
    assert bundle["template"]["extensions"] == ["TASK_CHUNKING"]
    assert table["dependencies"] == [{"dependsOn": "Process"}]
    values = {v["name"]: v["value"] for v in bundle["parameter_values"]["parameterValues"]}
    assert values == {"Root": str(show.parent), "Chunk": 3, "Indices": "0-3"}
    assets = bundle["asset_references"]["assetReferences"]
    names = {Path(name).name for name in assets["inputs"]["filenames"]}
    assert names == {"rig.usda", "take.usda", "bind.json"}
    assert assets["outputs"]["directories"] == [str(show.parent / "shots")]
    listed = bundle["shots"]["shots"]
    assert [shot["name"] for shot in listed] == ["a", "b", "c", "d"]
    assert all(shot["process"]["skip_hooks"] == ["studio-hooks"] for shot in listed)


@pytest.mark.slow
def test_the_list_of_a_bundle_gives_the_results_of_the_show(show: Path, tmp_path: Path) -> None:
    listed = write_sequence_job(show, tmp_path / "job").written[-1]
    (row,) = process_sequence(listed, root=show.parent, index="2").value
    assert (row.name, row.state) == ("c", "processed")
    states = {row.name: row.state for row in process_sequence(show, gather=True).value}
    assert states == {"a": "missing", "b": "missing", "c": "kept", "d": "missing"}


def test_files_outside_of_the_root_are_refused(show: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not in"):
        write_sequence_job(show, tmp_path / "job", root=show.parent / "shots")
    with pytest.raises(InputError, match="a task of 0 shots"):
        write_sequence_job(show, tmp_path / "job", chunk=0)
    assert not (tmp_path / "job").exists()


@pytest.mark.slow
def test_a_run_of_the_bundle_gives_the_same_bytes(show: Path, tmp_path: Path) -> None:
    shutil.copytree(show.parent, tmp_path / "farm")
    template = write_sequence_job(tmp_path / "farm/show.toml", tmp_path / "job", chunk=2).written[0]
    assert "passes validation checks" in openjd("check", template)
    program = Path(sys.executable).with_name("usdface")
    values = ["-p", f"Root={tmp_path / 'farm'}", "-p", f"Usdface={program}"]
    result = openjd("run", template, *values, "--step", "Table", "--run-dependencies")
    assert "Shot(CHUNK[INT]) = 0-1" in result and "Shot(CHUNK[INT]) = 2-3" in result
    assert "openjd_progress: 50.0" in result
    assert "good" in (tmp_path / "farm/table.html").read_text()
    process_sequence(show)

    def results(folder: Path) -> dict[str, str]:
        found = digests(folder / "shots").items()
        return {name: digest for name, digest in found if not name.endswith((".json", ".npz"))}

    assert results(tmp_path / "farm") == results(show.parent)
    assert len(results(show.parent)) == 4 * 4  # the shot, its root, solve and express layers
