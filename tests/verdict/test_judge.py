import json

import numpy as np
import pytest

from usdface.errors import ERROR_CODES, SolveError
from usdface.verdict import CRITERIA, Measured, judge
from usdface.verdict.judge import Verdict, refuse_unusable, verdict_from

CODES = [criterion.code for criterion in CRITERIA]


def at(code: str, value: float) -> dict[str, Measured]:
    return {code: Measured(value, "markers", ("chin",), (0, 29))}


def test_codes_are_unique_and_limits_rise() -> None:
    assert len(set(CODES)) == len(CODES)
    assert all(0 < criterion.look_at < criterion.not_usable for criterion in CRITERIA)


def test_nothing_measured_is_nothing_wrong() -> None:
    assert judge({}).level == "good"


@pytest.mark.parametrize("criterion", CRITERIA, ids=CODES)
def test_each_limit_begins_its_level(criterion) -> None:
    code = criterion.code
    assert judge(at(code, np.nextafter(criterion.look_at, 0))).level == "good"
    assert judge(at(code, criterion.look_at)).level == "look_at"
    if np.isfinite(criterion.not_usable):
        assert judge(at(code, np.nextafter(criterion.not_usable, 0))).level == "look_at"
        assert judge(at(code, criterion.not_usable)).level == "not_usable"
    else:
        assert judge(at(code, 1e9)).level == "look_at"


@pytest.mark.parametrize("criterion", CRITERIA, ids=CODES)
def test_a_reason_is_a_line_and_its_numbers_are_plain(criterion) -> None:
    verdict = judge(at(criterion.code, 2 * criterion.look_at))
    (reason,) = verdict.reasons
    assert "\n" not in reason.message and "{" not in reason.message and criterion.remedy
    (plain,) = json.loads(json.dumps(verdict.as_dict(), allow_nan=False))["reasons"]
    assert plain["code"] == criterion.code
    assert plain["value"] == pytest.approx(2 * criterion.look_at)
    assert plain["markers"] == ["chin"] and plain["frames"] == [0, 29]


def test_the_three_that_weigh_most_come_first() -> None:
    """What makes a result unusable is before what does not, then what is further off its limit."""
    measured = {
        "TAKE_SIZE": Measured(1000.0),  # 500 times its limit, and yet usable
        "PLACES_MISFIT": Measured(0.30),
        "NEUTRAL_EXPRESSIVE": Measured(0.9),
        "REGION_FLAT": Measured(4.0),
    }
    verdict = judge(measured)
    assert verdict.level == "not_usable"
    codes = [reason.criterion.code for reason in verdict.reasons]
    assert codes == ["NEUTRAL_EXPRESSIVE", "PLACES_MISFIT", "TAKE_SIZE"]


def test_only_what_is_not_usable_is_refused() -> None:
    refuse_unusable(judge(at("TAKE_SIZE", 10.0)))
    with pytest.raises(SolveError, match="not usable") as caught:
        refuse_unusable(judge(at("PLACES_MISFIT", 0.9)))
    assert caught.value.code == "RESULT_UNUSABLE" and caught.value.code in ERROR_CODES
    with pytest.raises(SolveError, match="no verdict") as caught:
        refuse_unusable(None)
    assert caught.value.code == "RESULT_UNUSABLE"


def test_a_verdict_comes_back_from_its_plain_values() -> None:
    verdict = judge(at("PLACES_MISFIT", 0.5) | at("TAKE_SIZE", 10.0))
    assert verdict_from(json.loads(json.dumps(verdict.as_dict()))) == verdict
    assert verdict_from(Verdict("good").as_dict()) == Verdict("good")


@pytest.mark.parametrize(
    "plain",
    [
        *(None, 3, "good", [], {}, {"reasons": 3}, {"reasons": [3]}, {"reasons": [{}]}),
        {"reasons": [{"code": "TAKE_SIZE", "value": "many"}]},
        {"reasons": [{"code": "TAKE_SIZE", "value": 10, "frames": [1e999]}]},
        {"reasons": [{"code": "TAKE_SIZE", "value": 10, "markers": 3}]},
    ],
)
def test_what_is_no_verdict_is_none(plain: object) -> None:
    assert verdict_from(plain) is None


@pytest.mark.parametrize(
    "plain",
    [
        {"level": "not_usable", "reasons": [{"code": "NEWER_CODE", "value": 9}]},
        {"level": "not_usable", "reasons": [{"code": "TAKE_SIZE", "value": float("nan")}]},
        {"level": "not_usable", "reasons": [{"code": "TAKE_SIZE", "value": 1.0}]},
        {"level": "look_at", "reasons": []},
        {"reasons": []},
    ],
)
def test_a_verdict_whose_reasons_are_none_here_is_not_good(plain: object) -> None:
    assert verdict_from(plain) is None
