"""Clips find their takes by timecode."""

from pathlib import Path
from typing import Any

import pytest

from usdface.io.cut_file import CutEvent
from usdface.show.conform import TakeClock, conformed

TAKES = (
    TakeClock(Path("a010.usdc"), "A010.trc", 3600.0, 10.0, 60.0),
    TakeClock(Path("a020.usdc"), "A020.trc", 3608.0, 10.0, 60.0),
)


def shots(
    *events: CutEvent, handles: int = 0, rate: float = 0.0
) -> tuple[list[dict[str, Any]], list[str]]:
    entries, findings = conformed(events, TAKES, handles, rate)
    return entries, [found.code for found in findings]


def test_a_clip_is_a_range_of_the_take_that_holds_it() -> None:
    entries, codes = shots(CutEvent("sq010", (), 3602.0, 48, 24.0), handles=8)
    assert entries == [
        {
            "name": "sq010",
            "take": Path("a010.usdc"),
            "process": {"deliver": {"start": 48, "end": 95, "rate": 24.0, "handles": 8}},
        }
    ]
    assert codes == []


def test_where_two_takes_hold_it_the_media_decides_or_none_does() -> None:
    both = CutEvent("sq020", ("a020",), 3608.5, 12, 24.0)
    assert shots(both)[0][0]["take"] == Path("a020.usdc")
    unnamed = CutEvent("sq020", ("B7",), 3608.5, 12, 24.0)
    assert shots(unnamed) == ([], ["CUT_TAKE_AMBIGUOUS"])


def test_a_clip_without_a_take_has_no_shot() -> None:
    assert shots(CutEvent("sq030", (), 100.0, 12, 24.0)) == ([], ["CUT_TAKE_MISSING"])


def test_a_clip_that_a_take_holds_in_part_keeps_its_range() -> None:
    entries, codes = shots(CutEvent("early", (), 3599.0, 48, 24.0))
    assert entries[0]["process"]["deliver"]["start"] == -24 and codes == []


def test_another_rate_counts_other_frames_and_says_where_they_do_not_meet() -> None:
    clip = CutEvent("sq040", (), 3602.5, 48, 24.0)
    entries, codes = shots(clip, rate=30.0)
    assert entries[0]["process"]["deliver"] == {"start": 75, "end": 134, "rate": 30.0}
    assert codes == []
    between = CutEvent("sq050", (), 3602.0 + 1 / 24, 48, 24.0)
    entries, codes = shots(between, rate=30.0)
    assert entries[0]["process"]["deliver"]["start"] == 61
    assert codes == ["CUT_BETWEEN_FRAMES"]


def test_frames_that_last_longer_than_their_timecode_says() -> None:
    """240 frames after the start they are the 240th, at 23.976 as at 24 Hz."""
    for rate in (24.0, 23.976):
        entries, _ = shots(CutEvent("x", ("a010",), 3600.0 + 9.0, 12, rate))
        assert entries[0]["process"]["deliver"]["start"] == 216


def test_names_are_those_of_files_and_told_apart() -> None:
    clips = [CutEvent(name, ("a010",), 3601.0, 12, 24.0) for name in ("a/b c.mov", "b c", "")]
    assert [entry["name"] for entry in shots(*clips)[0]] == ["b_c", "b_c_2", "a010"]


def test_a_number_behind_a_name_makes_no_name_of_another_clip() -> None:
    clips = [CutEvent(name, ("a010",), 3601.0, 12, 24.0) for name in ("a", "a", "a_2", "a")]
    assert [entry["name"] for entry in shots(*clips)[0]] == ["a", "a_3", "a_2", "a_4"]


@pytest.mark.parametrize("handles", [0, 3])
def test_entries_are_of_a_show_file(handles: int) -> None:
    (entry,), _ = shots(CutEvent("a", ("a010",), 3601.0, 1, 24.0), handles=handles)
    assert entry["process"]["deliver"]["end"] == entry["process"]["deliver"]["start"]
