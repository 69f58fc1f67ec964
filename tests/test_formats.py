from pathlib import Path

import pytest

from usdface.errors import InputError
from usdface.formats import ExportTarget, RigReader, TakeReader, suffixes_of
from usdface.options import ExportOptions, RigOptions, TakeOptions


def nothing(*_: object) -> None:
    raise AssertionError


READER = TakeReader(name="A", suffixes=(".a", ".b"), options=("rate",), read=nothing)


@pytest.mark.parametrize(
    "wrong",
    [
        {"name": " "},
        {"suffixes": ("a",)},
        {"suffixes": (".",)},
        {"suffixes": (".A",)},
        {"suffixes": (3,)},
        {"suffixes": ()},
        {"options": ("speed",)},
        {"folder": True},
        {"suffixes": ".a"},
        {"options": "rate"},
        {"read": None},
        {"read": "acme:read"},
        {"sniff": True},
    ],
)
def test_a_reader_that_is_described_wrongly_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InputError) as raised:
        TakeReader(**{"name": "A", "suffixes": (".a",), "read": nothing} | wrong)  # type: ignore[arg-type]
    assert raised.value.code == "SETTING_WRONG"


def test_a_target_either_writes_or_packs() -> None:
    for functions in ({}, {"write": nothing, "pack": nothing}):
        with pytest.raises(InputError, match="either write or pack"):
            ExportTarget(name="A", suffixes=(".a",), **functions)  # type: ignore[arg-type]


def test_a_text_for_a_tuple_and_a_value_for_a_function_are_named() -> None:
    with pytest.raises(InputError, match=r"suffixes is '\.a'; expected a tuple, \('\.a',\)"):
        TakeReader(name="A", suffixes=".a", read=nothing)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="write is 'w'; expected a function"):
        ExportTarget(name="A", suffixes=(".a",), write="w")  # type: ignore[arg-type]


def test_options_that_are_not_followed_are_refused() -> None:
    path = Path("x.a")
    READER.check_options(path, TakeOptions(rate=60))
    with pytest.raises(InputError, match=r"x\.a: A has no use for units = 'mm'; leave it out"):
        READER.check_options(path, TakeOptions(rate=60, units="mm"))
    with pytest.raises(InputError, match=r"has no use for names = n\.csv; leave it out"):
        READER.check_options(path, TakeOptions(names=Path("n.csv")))
    rig = RigReader(name="R", suffixes=(".r",), read=nothing)
    rig.check_options(path, RigOptions())
    with pytest.raises(InputError, match="neutral"):
        rig.check_options(path, RigOptions(neutral="a"))


def test_clips_are_chosen_for_whatever_is_not_packed() -> None:
    chosen = ExportOptions(clip="walk")
    ExportTarget(name="A", suffixes=(".a",), write=nothing).check_options(Path(), chosen)
    with pytest.raises(InputError, match="clip = 'walk'"):
        ExportTarget(name="A", suffixes=(".a",), pack=nothing).check_options(Path(), chosen)


def test_suffixes_are_claimed_in_any_case_and_of_files_only(tmp_path: Path) -> None:
    assert READER.claims(Path("X.B")) and not READER.claims(Path("x.c"))
    (tmp_path / "x.a").mkdir()
    assert not READER.claims(tmp_path / "x.a")
    folders = TakeReader(name="F", folder=True, sniff=lambda path: True, read=nothing)
    assert folders.claims(tmp_path) and folders.recognises(tmp_path)


def test_suffixes_are_listed_once() -> None:
    other = RigReader(name="R", suffixes=(".c", ".a"), read=nothing)
    assert suffixes_of([READER, other]) == (".a", ".b", ".c")
