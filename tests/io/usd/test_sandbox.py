"""Files that end the process which opens them, or take any memory or time, end no command."""

import os
import sys
from pathlib import Path

import numpy as np
import pxr
import pytest
from pxr import Sdf, Usd, Vt

from usdface.cli import main
from usdface.errors import InputError
from usdface.io.usd import sandbox, sandbox_worker
from usdface.io.usd.dependencies import dependencies
from usdface.io.usd.stage import open_layer, open_stage

DEEP = "#usda 1.0\n" + "".join(f'def "a{n}" {{\n' for n in range(60_000)) + 60_000 * "}\n"


@pytest.fixture(autouse=True)
def from_outside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("USDFACE_TRUSTED")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The files that a worker was asked about."""
    names: list[str] = []
    ask = sandbox._open_in_worker

    def listed(python: str, path: Path) -> dict[str, object]:
        names.append(path.name)
        return ask(python, path)

    monkeypatch.setattr(sandbox, "_open_in_worker", listed)
    return names


def test_text_that_is_nested_too_deeply(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "deep.usda"
    path.write_text(DEEP)
    for opens in (open_stage, open_layer):
        with pytest.raises(InputError, match="ends the process that opens it"):
            opens(path)
    assert dependencies(path) == []
    report = tmp_path / "report.json"
    assert main(["check", str(path), "--report", str(report)]) == 1
    assert capfd.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("name", ["a.usdc", "a.usda", "a.usd", "a.usdz"])
def test_an_empty_file_is_called_so(tmp_path: Path, asked: list[str], name: str) -> None:
    path = tmp_path / name
    path.touch()
    for opens in (open_stage, open_layer):
        with pytest.raises(InputError, match=f"{name} is empty") as raised:
            opens(path)
        assert raised.value.code == "FILE_UNREADABLE"
    assert not dependencies(path) and not asked


@pytest.mark.parametrize("trusted", ["0", "1"])
def test_a_path_that_is_not_utf_8(
    tmp_path: Path, asked: list[str], monkeypatch: pytest.MonkeyPatch, trusted: str
) -> None:
    folder = tmp_path / os.fsdecode(b"a\xff")
    folder.mkdir()
    (folder / "a.usda").write_text("#usda 1.0\n")
    monkeypatch.setenv("USDFACE_TRUSTED", trusted)
    monkeypatch.chdir(folder)
    with pytest.raises(InputError, match=r"udcff/a\.usda is not UTF-8, .* rename it") as raised:
        open_stage(Path("a.usda"))
    assert raised.value.code == "FILE_UNREADABLE" and asked == []


@pytest.mark.slow
def test_references_without_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for n in range(9):
        named = "".join(f'def "c{k}" (references = @{n + 1}.usda@</a>) {{}}\n' for k in range(10))
        text = f'#usda 1.0\n(defaultPrim = "a")\ndef "a" {{\n{named if n < 8 else ""}}}\n'
        (tmp_path / f"{n}.usda").write_text(text)
    monkeypatch.setattr(sandbox, "_TIMEOUT", 1.0)
    with pytest.raises(InputError, match="does not open within 1 s"):
        open_stage(tmp_path / "0.usda")


def test_a_fifo_as_a_layer(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo.usda")
    (tmp_path / "a.usda").write_text("#usda 1.0\n(subLayers = [@fifo.usda@])\n")
    with pytest.raises(InputError, match="is no regular file"):
        open_stage(tmp_path / "a.usda")


@pytest.mark.slow
def test_the_layer_that_is_damaged_is_named(tmp_path: Path) -> None:
    whole, cut, shot = (tmp_path / name for name in ("whole.usdc", "cut.usdc", "shot.usda"))
    stage = Usd.Stage.CreateNew(str(whole))
    stage.DefinePrim("/a", "Mesh")
    stage.Save()
    cut.write_bytes(whole.read_bytes()[:200])
    shot.write_text("#usda 1.0\n(subLayers = [@whole.usdc@, @cut.usdc@])\n")
    with pytest.raises(InputError, match=rf"^{shot} brings in {cut}, which cannot be read as USD"):
        open_stage(shot)
    with pytest.raises(InputError, match=rf"^{cut} cannot be read as USD"):
        open_stage(cut)


@pytest.mark.slow
@pytest.mark.parametrize("clock", ["0", "-24", "inf", "nan"])
def test_a_clock_that_does_not_run(tmp_path: Path, clock: str) -> None:
    (tmp_path / "a.usda").write_text(f"#usda 1.0\n(\n timeCodesPerSecond = {clock}\n)\n")
    with pytest.raises(InputError, match="timeCodesPerSecond"):
        open_stage(tmp_path / "a.usda")


@pytest.mark.slow
def test_a_file_is_tried_once(tmp_path: Path, asked: list[str]) -> None:
    layer, root = tmp_path / "layer.usda", tmp_path / "root.usda"
    layer.write_text('#usda 1.0\ndef "a" {}\n')
    root.write_text("#usda 1.0\n(subLayers = [@layer.usda@])\n")
    open_stage(root)
    open_stage(root)
    assert asked == ["root.usda"]
    layer.write_text('#usda 1.0\ndef "b" {}\n')
    open_stage(root)
    assert asked == ["root.usda", "root.usda"]


def test_a_layer_is_known_by_the_file_that_is_composed_of_it(
    tmp_path: Path, asked: list[str]
) -> None:
    part, root = tmp_path / "part.usda", tmp_path / "root.usda"
    part.write_text('#usda 1.0\ndef "A" {}\n')
    root.write_text("#usda 1.0\n(subLayers = [@./part.usda@])\n")
    open_layer(part, within=tmp_path / "missing.usda")
    open_stage(root)
    assert asked == ["part.usda", "root.usda"]
    part.write_text('#usda 1.0\ndef "B" {}\n')  # nothing that was known holds any more
    open_layer(part, within=root)
    assert asked[2:] == ["part.usda"]
    open_stage(root)
    part.write_bytes(part.read_bytes() + b"\n")
    open_stage(root)
    open_layer(part, reread=True, within=root)
    assert asked[3:] == ["root.usda", "root.usda"]


@pytest.mark.slow
def test_a_refused_file_is_not_tried_again_at_once(
    tmp_path: Path, asked: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "deep.usda"
    path.write_text(DEEP)
    assert main(["export", str(path), "-o", str(tmp_path / "a.glb")]) == 1
    assert asked == ["deep.usda"]  # which is looked at for what it reads, and then read
    path.write_text("#usda 1.0\n")
    open_stage(path)
    path.write_text(DEEP)
    with pytest.raises(InputError):
        open_stage(path)
    monkeypatch.setattr(sandbox, "_REFUSED_FOR", 0.0)
    with pytest.raises(InputError):
        open_stage(path)
    assert asked == 4 * ["deep.usda"]


def test_trusted_files_are_opened_at_once(
    tmp_path: Path, asked: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.usda").write_text('#usda 1.0\ndef "a" {}\n')
    monkeypatch.setenv("USDFACE_TRUSTED", "1")
    open_stage(tmp_path / "a.usda")
    assert asked == []


@pytest.mark.slow
def test_a_folder_that_others_may_write_is_not_believed(tmp_path: Path, asked: list[str]) -> None:
    (tmp_path / "a.usda").write_text('#usda 1.0\ndef "a" {}\n')
    (tmp_path / "cache/usdface/opened").mkdir(parents=True)
    (tmp_path / "cache/usdface/opened").chmod(0o777)
    open_stage(tmp_path / "a.usda")
    open_stage(tmp_path / "a.usda")
    assert len(asked) == 2


def test_the_worker_allows_for_large_files() -> None:
    assert sandbox_worker._MEMORY_PER_BYTE >= 10  # text becomes several times its size


@pytest.mark.slow
def test_a_value_that_cannot_be_read(tmp_path: Path) -> None:
    path = tmp_path / "a.usdc"
    stage = Usd.Stage.CreateNew(str(path))
    attribute = stage.DefinePrim("/A").CreateAttribute("w", Sdf.ValueTypeNames.FloatArray)
    rng = np.random.default_rng(0)
    for code in range(50):
        attribute.Set(Vt.FloatArray.FromNumpy(rng.random(40, np.float32)), code)
    stage.Save()
    del attribute, stage
    data = bytearray(path.read_bytes())
    refused = 0
    for place in range(200, 600, 50):  # where values lie
        changed = data.copy()
        changed[-place] ^= 0xFF
        spoilt = tmp_path / f"{place}.usdc"
        spoilt.write_bytes(changed)
        try:
            open_stage(spoilt)
        except InputError as error:
            assert "\n" not in str(error)
            refused += 1
    assert refused


def test_the_worker_takes_the_usd_of_a_program_that_put_it_on_the_path_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.usda").write_text("#usda 1.0\n")

    home = str(Path(pxr.__file__).parents[1])
    assert sandbox._places().split(os.pathsep)[0] == home
    monkeypatch.setenv("PYTHONPATH", "/elsewhere")
    assert sandbox._places().split(os.pathsep) == [home, "/elsewhere"]
    python = str(Path(sys.base_prefix, "bin", "python3"))  # which has no USD of its own
    monkeypatch.setattr(sandbox, "_python", lambda: python)
    sandbox.try_to_open(tmp_path / "a.usda")
