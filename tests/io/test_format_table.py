"""Formats of other packages: found lazily, checked, never instead of one of usdface."""

import importlib.metadata
from collections.abc import Iterator
from pathlib import Path

import pytest
from other_packages import Install, install

from usdface.errors import InputError, PluginError
from usdface.findings import Finding
from usdface.io.export_targets import EXPORT_TARGETS
from usdface.io.format_table import FormatTable, conflicts
from usdface.io.rigs.formats import RIG_READERS
from usdface.io.takes.files import read_take
from usdface.io.takes.formats import TAKE_READERS
from usdface.pipeline import list_formats

__all__ = ["install"]

READER = """
from usdface import MarkerTake, TakeReader

def read(path, options):
    return MarkerTake(("a",), [0.0, 0.1], [[[1, 2, 3]], [[1, 2, 4]]], 10.0), []

A = TakeReader(name="{name}", suffixes={suffixes}, read=read{more})
"""
GROUP = "usdface.takes"


def reader(name: str, *suffixes: str, more: str = "") -> str:
    return READER.format(name=name, suffixes=suffixes, more=more)


def take_file(folder: Path, name: str) -> Path:
    (folder / name).write_text("x" * 100)
    return folder / name


@pytest.mark.parametrize("table", [TAKE_READERS, RIG_READERS, EXPORT_TARGETS])
def test_the_table_of_usdface_loads_and_names_every_suffix(table: FormatTable) -> None:  # type: ignore[type-arg]
    for each in table.built_in:
        function = getattr(each, "read", None) or each.write or each.pack
        module = importlib.import_module(function.__module__)
        assert callable(getattr(module, function.__qualname__))
        assert each.name in table.summary
        assert all(suffix in table.summary for suffix in each.suffixes)


@pytest.mark.parametrize(
    ("table", "name", "remedy"),
    [
        (RIG_READERS, "face.obj", "name the folder"),
        (RIG_READERS, "face.FBX", "export the character as glTF or USD"),
        (RIG_READERS, "take.c3d", "`usdface take` reads a recording"),
        (TAKE_READERS, "head.glb", "`usdface rig` reads a character"),
    ],
)
def test_a_file_for_another_command_is_sent_there(
    tmp_path: Path,
    table: FormatTable,  # type: ignore[type-arg]
    name: str,
    remedy: str,
) -> None:
    with pytest.raises(InputError, match=f"are not read; expected .*; {remedy}"):
        table.find(take_file(tmp_path, name))


def test_of_a_folder_the_files_that_would_be_read_are_named(tmp_path: Path) -> None:
    for name in ("b.C3D", "a.trc", "notes.md"):
        take_file(tmp_path, name)
    with pytest.raises(
        InputError, match=r"not read; expected .*; name a file in it: a\.trc, b\.C3D$"
    ):
        TAKE_READERS.find(tmp_path)


def test_a_folder_that_cannot_be_looked_into_is_an_error_of_ours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def denied(_: Path) -> Iterator[Path]:
        raise PermissionError

    monkeypatch.setattr(Path, "iterdir", denied)
    with pytest.raises(InputError, match=r"folders like this are not read; expected [^;]*$"):
        TAKE_READERS.find(tmp_path)


def test_no_entry_point_is_looked_up_for_files_that_usdface_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(**_: str) -> None:
        raise AssertionError("looked up")

    monkeypatch.setattr(importlib.metadata, "entry_points", fail)
    path = tmp_path / "a.csv"
    path.write_text("time,A_x,A_y,A_z\n0,1,2,3\n")
    assert read_take(path)[0].names == ("A",)
    with pytest.raises(AssertionError, match="looked up"):
        read_take(take_file(tmp_path, "a.nothing"))


def test_a_suffix_of_usdface_is_never_taken_over(install: Install, tmp_path: Path) -> None:
    install("greedy", reader("Greedy", ".csv", ".greedy"), {GROUP: {"a": "greedy:A"}})
    path = tmp_path / "a.csv"
    path.write_text("time,A_x,A_y,A_z\n0,1,2,3\n")
    take, findings = read_take(path)
    assert take.names == ("A",)
    take, findings = read_take(take_file(tmp_path, "a.greedy"))
    assert take.names == ("a",)
    (reported,) = findings
    assert reported.code == "PLUGIN_CONFLICT"
    assert reported.where == "greedy 1.0 (greedy:A)"
    assert reported.message == "Greedy claims .csv, which stays with marker CSV of usdface"


def test_two_packages_that_claim_a_file_are_both_named(install: Install, tmp_path: Path) -> None:
    install("one", reader("One", ".xyz"), {GROUP: {"a": "one:A"}})
    install("two", reader("Two", ".xyz"), {GROUP: {"a": "two:A"}})
    with pytest.raises(PluginError) as raised:
        read_take(take_file(tmp_path, "a.xyz"))
    assert raised.value.code == "PLUGIN_CONFLICT"
    assert "One of one 1.0 (one:A) and Two of two 1.0 (two:A) both fit" in str(raised.value)
    (named,) = conflicts(TAKE_READERS.of_other_packages()[0])
    assert named.values["claimed_by"] == ["One of one 1.0 (one:A)", "Two of two 1.0 (two:A)"]


def test_the_content_decides_between_two_packages(install: Install, tmp_path: Path) -> None:
    sniff = ", sniff=lambda path: path.read_text().startswith('{}')"
    install("one", reader("One", ".xyz", more=sniff.format("1")), {GROUP: {"a": "one:A"}})
    install("two", reader("Two", ".xyz", more=sniff.format("2")), {GROUP: {"a": "two:A"}})
    path = tmp_path / "a.xyz"
    for text, name in (("1", "One"), ("2", "Two")):
        path.write_text(text)
        assert TAKE_READERS.find(path)[0].format.name == name
    path.write_text("3")
    with pytest.raises(InputError, match=r"'\.xyz' are not read"):
        read_take(path)


BROKEN = {
    "import": ("import nothing_like_it", "ModuleNotFoundError: No module named 'nothing_like_it'"),
    "name": ("", "AttributeError: module 'broken' has no attribute 'A'"),
    "type": ("A = print", "is builtin_function_or_method; expected a usdface.TakeReader"),
    "exit": ("raise SystemExit(3)", "SystemExit: 3"),
    "suffix": (reader("B", "xyz"), "expected lower case with its dot"),
    "options": (reader("B", ".b", more=", options=('unit',)"), "unknown option 'unit'"),
    "folder": (reader("B", more=", folder=True"), "a reader of folders needs a sniff"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_a_package_that_cannot_be_loaded_is_never_skipped(
    install: Install, tmp_path: Path, case: str
) -> None:
    source, reason = BROKEN[case]
    install("broken", source, {GROUP: {"a": "broken:A"}})
    path = take_file(tmp_path, "a.xyz")
    with pytest.raises(PluginError) as raised:
        read_take(path)
    assert raised.value.code == "PLUGIN_FAILED"
    for words in (str(path), "broken 1.0 (broken:A)", reason):
        assert words in str(raised.value)
    assert "\n" not in str(raised.value)
    assert [f.where for f in list_formats().findings] == ["broken 1.0 (broken:A)"]
    install("good", reader("Good", ".xyz"), {GROUP: {"a": "good:A"}})
    take, findings = read_take(path)
    assert take.names == ("a",)
    assert [(f.code, f.severity) for f in findings] == [("PLUGIN_FAILED", "warning")]


FAILING = {
    "raises": ("1 / 0", "failing.read failed: ZeroDivisionError: division by zero"),
    "lines": ("raise ValueError('a\\nb')", "failing.read failed: ValueError: a b"),
    "exits": ("raise SystemExit()", "failing.read failed: SystemExit"),
    "nothing": ("return None", "NoneType; expected (take, findings)"),
    "array": ("return [[1.0]], []", "list; expected a MarkerTake or a WeightsTake"),
    "findings": ("return good()[0], None", "NoneType; expected a list of findings"),
    "code": ("return good()[0], [Finding('X', '', 'x', 'info')]", "the finding 'X'"),
    "own": ("raise Own('x')", "x (failing.read of failing 1.0 (failing:A))"),
}


@pytest.mark.parametrize("case", FAILING)
def test_a_reader_that_fails_is_one_line(install: Install, tmp_path: Path, case: str) -> None:
    body, reason = FAILING[case]
    source = f"""
from usdface import Finding, MarkerTake, TakeReader, UsdFaceError

class Own(UsdFaceError):
    pass

def good():
    return MarkerTake(("a",), [0.0], [[[1, 2, 3]]]), []

def read(path, options):
    {body}

A = TakeReader(name="Failing", suffixes=(".xyz",), read=read)
"""
    install("failing", source, {GROUP: {"a": "failing:A"}})
    with pytest.raises(PluginError) as raised:
        read_take(take_file(tmp_path, "a.xyz"))
    assert reason in str(raised.value) and "failing 1.0 (failing:A)" in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_failing_sniff_names_its_package(install: Install, tmp_path: Path) -> None:
    source = reader("B", ".xyz", more=", sniff=lambda path: 1 / 0")
    install("failing", source, {GROUP: {"a": "failing:A"}})
    with pytest.raises(PluginError, match=r"failing 1\.0 \(failing:A\).*ZeroDivisionError"):
        read_take(take_file(tmp_path, "a.xyz"))


def test_findings_are_those_of_usdface() -> None:
    entry = TAKE_READERS.find(Path("a.c3d"))[0]
    good = Finding("UNITS_ASSUMED", "a", "b", "warning")
    assert entry.findings((good,)) == [good]
