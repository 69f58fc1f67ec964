from pathlib import Path

import pytest

from usdface.errors import InputError
from usdface.rule_learning.labels import Label


@pytest.mark.parametrize(
    ("emotion", "is_one"), [("awe", True), ("neutral", False), ("none", False)]
)
def test_only_an_emotion_is_one(emotion: str, is_one: bool) -> None:
    assert Label(Path("a.trc"), 0, 0, "frame", emotion).is_emotion is is_one


@pytest.mark.parametrize(
    "wrong",
    [
        {"start": -1},
        {"end": float("inf")},
        {"start": 3},
        {"intensity": 0},
        {"emotion": ""},
        {"emotion": "Or"},
    ],
)
def test_what_cannot_be_is_refused(wrong: dict[str, object]) -> None:
    good = {"take": Path("a"), "start": 0, "end": 1, "unit": "s", "emotion": "joy"}
    with pytest.raises(InputError, match="expected"):
        Label(**(good | wrong))  # type: ignore[arg-type]
