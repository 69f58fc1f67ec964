"""`usdface check --facs`: files, the table, the figure, what cannot be judged."""

import json
from pathlib import Path

import numpy as np
import pytest
from spoilt_shapes import renamed, silenced

import usdface
from usdface.cli import main
from usdface.errors import InputError
from usdface.io.gltf.write import write_gltf
from usdface.rigs import BlendShape, Mesh, Rig

HEAD = Path(__file__).parents[2] / "examples" / "head.usdc"
FLAT = Mesh("Face", np.eye(3), [3], [0, 1, 2], shapes=(BlendShape("jawOpen", [1], [[0, 0, 1]]),))


@pytest.fixture(scope="module")
def spoilt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example's head as glTF with a dead blink and two names exchanged."""
    rig, _ = usdface.read_rig(HEAD)
    names = {"browInnerUp": "mouthPucker", "mouthPucker": "browInnerUp"}
    path = tmp_path_factory.mktemp("facs") / "spoilt.glb"
    write_gltf(renamed(silenced(rig, "eyeBlinkLeft"), names), path)
    return path


def test_the_example_is_right(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(HEAD), "--facs", "--strict"]) == 0
    printed = capsys.readouterr().out
    assert "mouthSmileLeft" in printed and "AU12L" in printed and "moved [mm]" in printed
    assert "sadness" in printed and "criteria of the paper met" in printed


@pytest.mark.slow
def test_faults_are_findings_in_table_and_json(
    spoilt: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(spoilt), "--facs"]) == 0  # warnings
    printed = capsys.readouterr().out
    assert "SWAPPED with mouthPucker" in printed and "FACS_SHAPE_DEAD" in printed
    assert main(["check", str(spoilt), "--facs", "--strict", "--format", "json"]) == 1
    report = json.loads(capsys.readouterr().out)
    found = {(f["code"], f["where"]) for f in report["findings"] if f["severity"] == "warning"}
    assert found == {
        ("FACS_SHAPE_DEAD", "eyeBlinkLeft"),
        ("FACS_SHAPES_SWAPPED", "browInnerUp"),
        ("FACS_SHAPES_SWAPPED", "mouthPucker"),
    }
    (judged,) = report["facs"]
    assert judged["counts"]["swapped"] == 2
    rows = {row["shape"]: row for row in judged["shapes"]}
    assert rows["mouthSmileLeft"]["points_mm"]["left lip corner"] > 10.0
    assert rows["browInnerUp"]["shown"] == "AU18"


@pytest.mark.slow
def test_the_figure_names_shapes_and_verdicts(spoilt: Path, tmp_path: Path) -> None:
    result = usdface.check(spoilt, facs=True, figure=tmp_path / "a.svg")
    assert result.written == (tmp_path / "a.svg",)
    content = (tmp_path / "a.svg").read_text()
    for text in ("mouthSmileLeft", "AU12L", "swapped with mouthPucker", "dead", "surprise"):
        assert text in content, text


@pytest.mark.slow
def test_what_is_no_face_is_not_judged(tmp_path: Path) -> None:
    path = tmp_path / "flat.glb"
    write_gltf(Rig("r", (FLAT,)), path)
    result = usdface.check([path, HEAD], facs=True)
    assert [(f.code, f.where) for f in result.findings if f.severity == "warning"] == [
        ("FACS_NOT_JUDGED", str(path))
    ]
    flat, head = result.details["facs"]
    assert flat == {"file": str(path)} and head["counts"]["done"] == 51


def test_a_figure_that_was_there_before_was_not_written(tmp_path: Path) -> None:
    write_gltf(Rig("r", (FLAT,)), tmp_path / "flat.glb")
    (tmp_path / "old.png").write_bytes(b"old")
    result = usdface.check(tmp_path / "flat.glb", facs=True, figure=tmp_path / "old.png")
    assert "FACS_NOT_JUDGED" in {found.code for found in result.findings}
    assert result.written == () and (tmp_path / "old.png").read_bytes() == b"old"


@pytest.mark.slow
def test_files_that_cannot_be_read_are_named_once(tmp_path: Path) -> None:
    torn = tmp_path / "torn.glb"
    torn.write_bytes(b"glTF")
    codes = [f.code for f in usdface.check([torn, HEAD], facs=True).findings]
    assert codes.count("FILE_UNREADABLE") == 1 and "FACS_NOT_JUDGED" not in codes


@pytest.mark.parametrize("files, facs", [((HEAD, HEAD), True), ((HEAD,), False)])
def test_a_figure_of_several_files_or_of_nothing_is_refused(
    tmp_path: Path, files: tuple[Path, ...], facs: bool
) -> None:
    with pytest.raises(InputError, match="--facs"):
        usdface.check(files, facs=facs, figure=tmp_path / "a.png")


def test_the_figure_overwrites_no_input(spoilt: Path) -> None:
    with pytest.raises(InputError, match="no picture"):
        usdface.check(spoilt, facs=True, figure=spoilt)
