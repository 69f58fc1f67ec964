import re
from pathlib import Path

import pytest

from usdface import errors
from usdface.errors import (
    ERROR_CODES,
    InputError,
    OutputError,
    SchemaError,
    SolveError,
    did_you_mean,
    errors_at,
)

PACKAGE = Path(errors.__file__).parent
TEXT = "\n".join(path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py"))


@pytest.mark.parametrize("kind", [InputError, OutputError, SchemaError, SolveError])
def test_each_kind_has_a_code_of_its_own(kind: type[errors.UsdFaceError]) -> None:
    assert kind("what, where").code == kind.default_code
    assert kind.default_code in ERROR_CODES
    assert str(kind("what, where", "TOO_LARGE")) == "what, where"
    assert kind("what, where", "TOO_LARGE").code == "TOO_LARGE"


def test_every_code_that_is_raised_is_in_the_table_and_the_other_way_round() -> None:
    raised = set(re.findall(r'"([A-Z]+(?:_[A-Z]+)+)"\s*,?\s*\)', TEXT)) & set(ERROR_CODES)
    raised |= set(re.findall(r'default_code = "([A-Z_]+)"', TEXT))
    assert raised == set(ERROR_CODES)
    given = set(re.findall(r'InputError\(\s*f?"[^"]*"(?:\s*f?"[^"]*")*,\s*"([A-Z_]+)"', TEXT))
    assert given and given <= set(ERROR_CODES)


def test_the_documented_table_is_the_table() -> None:
    page = PACKAGE.parent / "docs" / "findings.md"
    lines = page.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if line.startswith("* `")] == [
        f"* `{code}`: {says}" for code, says in sorted(ERROR_CODES.items())
    ]


def test_the_nearest_known_name_is_meant_or_none() -> None:
    known = ("jaw_left", "chin", "brow")
    assert did_you_mean("jaw_lefft", known) == "; did you mean jaw_left?"
    assert did_you_mean("xyzzy", known) == did_you_mean("chin", ()) == ""


def test_the_place_of_an_error_is_named_and_its_code_kept() -> None:
    with (
        pytest.raises(InputError, match=r"^shot\.usda: no take$") as caught,
        errors_at("shot.usda"),
    ):
        raise InputError("no take", "SHOT_INCOMPLETE")
    assert caught.value.code == "SHOT_INCOMPLETE"
    assert isinstance(caught.value.__cause__, InputError)
