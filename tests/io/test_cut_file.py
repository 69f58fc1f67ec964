"""Cuts that OpenTimelineIO reads; the reader of timecodes needs none."""

import sys
from pathlib import Path

import pytest

from usdface.errors import InputError, PluginError
from usdface.io.cut_file import read_cut, timecode_seconds

EDL = """TITLE: reel
FCM: NON-DROP FRAME

001  A010     V     C        01:00:02:00 01:00:04:00 00:00:00:00 00:00:02:00
* FROM CLIP NAME: sq010_0010
002  A020     V     C        01:10:00:12 01:10:01:12 00:00:02:00 00:00:03:00
* FROM CLIP NAME: sq010_0020
"""


@pytest.mark.parametrize(
    ("text", "rate", "frames"),
    [
        ("00:00:00:00", 24.0, 0),
        ("01:00:02:12", 24.0, 24 * 3602 + 12),
        ("13:13:04:31.652", 60.0, 60 * 47584 + 31.652),
        ("01:00:00:00", 23.976, 24 * 3600),
        ("00:01:00;02", 29.97, 1800),  # two labels are left out each minute
        ("00:10:00;00", 29.97, 17982),  # but not each tenth
        ("01:00:00;00", 59.94, 215784),
    ],
)
def test_a_timecode_counts_frames(text: str, rate: float, frames: float) -> None:
    assert timecode_seconds(text, rate, "take") * round(rate) == pytest.approx(frames)


def test_a_take_without_a_rate_has_no_timecode() -> None:
    with pytest.raises(InputError, match="at 0 frames a second"):
        timecode_seconds("00:00:01:00", 0.0, "take")


@pytest.mark.parametrize("text", ["", "10", "1:2:3", "00:00:00:24", "00:61:00:00", "a:b:c:d"])
def test_nonsense_is_no_timecode(text: str) -> None:
    with pytest.raises(InputError, match="expected HH:MM:SS:FF"):
        timecode_seconds(text, 24.0, "take")


@pytest.mark.parametrize("hour", ["00", "01"])
def test_the_clips_of_an_edl_have_name_reel_and_range(hour: str, tmp_path: Path) -> None:
    """Whatever the hour at which its record begins, as a programme's at one."""
    pytest.importorskip("opentimelineio", reason="cuts need usdface[otio]")
    text = EDL.replace(" 00:00:", f" {hour}:00:")
    # With the byte order mark of some editors.
    (tmp_path / "reel.edl").write_text(text, encoding="utf-8-sig")
    events, findings = read_cut(tmp_path / "reel.edl")
    assert [(e.name, e.media, e.start, e.frames, e.rate) for e in events] == [
        ("sq010_0010", ("A010",), 3602.0, 48, 24.0),
        ("sq010_0020", ("A020",), 4200.5, 24, 24.0),
    ]
    assert [found.code for found in findings] == ["RATE_ASSUMED"]


@pytest.mark.parametrize(
    ("timecodes", "rate", "start", "frames"),
    [
        ("01:00:02:12 01:00:04:12 00:00:00:00 00:00:02:00", 25.0, 3602 + 12 / 25, 50),
        ("01:00:02:29 01:00:04:00 00:00:00:00 00:00:01:01", 30.0, 3602 + 29 / 30, 31),
        ("01:00:02;29 01:00:04;00 00:00:00;00 00:00:01;01", 0.0, 107981 / 30, 31),
        ("01:00:02;29 01:00:04;00 00:00:00;00 00:00:01;01", 29.97, 107981 / 30, 31),
    ],
)
def test_an_edl_counts_the_frames_of_its_rate(
    timecodes: str, rate: float, start: float, frames: int, tmp_path: Path
) -> None:
    pytest.importorskip("opentimelineio", reason="cuts need usdface[otio]")
    (tmp_path / "reel.edl").write_text(f"TITLE: reel\n\n001  A010     V     C        {timecodes}\n")
    (event,), findings = read_cut(tmp_path / "reel.edl", rate)
    assert (event.start, event.frames) == (pytest.approx(start), frames)
    assert event.rate == pytest.approx(rate or 30_000 / 1001, rel=1e-5)
    assert [found.code for found in findings] == ([] if rate else ["RATE_ASSUMED"])


def test_otio_says_the_same_leaves_out_sound_and_reports_speed(tmp_path: Path) -> None:
    otio = pytest.importorskip("opentimelineio", reason="cuts need usdface[otio]")
    (tmp_path / "reel.edl").write_text(EDL)
    timeline = otio.adapters.read_from_file(str(tmp_path / "reel.edl"))
    clips = list(timeline.find_clips())
    sound = otio.schema.Track("sound", kind=otio.schema.TrackKind.Audio)
    sound.append(clips[0].deepcopy())
    timeline.tracks.append(sound)
    clips[1].effects.append(otio.schema.LinearTimeWarp(time_scalar=2.0))
    otio.adapters.write_to_file(timeline, str(tmp_path / "reel.otio"))
    events, findings = read_cut(tmp_path / "reel.otio")
    assert events == read_cut(tmp_path / "reel.edl")[0]
    assert [found.code for found in findings] == ["CUT_EFFECT_IGNORED"]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("cut.otio", "{"),
        ("cut.otio", '{"OTIO_SCHEMA": "Nonsense.1"}'),
        ("cut.otio", "[1, 2]"),
        ("cut.edl", "TITLE: empty\n"),
        ("cut.xml", "<xmeml/>"),
    ],
)
def test_what_is_no_cut_is_refused(tmp_path: Path, name: str, text: str) -> None:
    pytest.importorskip("opentimelineio", reason="cuts need usdface[otio]")
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError):
        read_cut(tmp_path / name)


def test_what_a_cut_does_beside_choosing_ranges_is_announced(tmp_path: Path) -> None:
    """Transitions, nested clips that are trimmed again, clips that are off or have no range."""
    otio = pytest.importorskip("opentimelineio", reason="cuts need usdface[otio]")

    def span(start: int, frames: int) -> object:
        time = otio.opentime.RationalTime
        return otio.opentime.TimeRange(time(start, 24), time(frames, 24))

    timeline = otio.schema.Timeline()
    track = otio.schema.Track(kind="Video")
    timeline.tracks.append(track)
    track.append(otio.schema.Clip(name="a", source_range=span(100, 48)))
    track.append(otio.schema.Transition(transition_type="SMPTE_Dissolve"))
    track.append(otio.schema.Clip(name="b", source_range=span(300, 48)))
    track.append(otio.schema.Clip(name="plain", source_range=span(300, 48)))
    track[-2].enabled = False
    track.append(otio.schema.Clip(name="bare"))
    nest = otio.schema.Stack(source_range=span(10, 5))
    nest.append(otio.schema.Clip(name="nested", source_range=span(500, 48)))
    track.append(nest)
    (tmp_path / "cut.otio").write_text(otio.adapters.write_to_string(timeline, "otio_json"))
    events, findings = read_cut(tmp_path / "cut.otio")
    assert [event.name for event in events] == ["a", "b", "plain", "nested"]
    assert [(found.code, found.where) for found in findings] == [
        ("CUT_EFFECT_IGNORED", "a"),
        ("CUT_EFFECT_IGNORED", "b"),
        ("CUT_EFFECT_IGNORED", "b"),
        ("CUT_TAKE_MISSING", "bare"),
        ("CUT_EFFECT_IGNORED", "nested"),
    ]


def test_a_cut_that_is_not_there_is_named_once(tmp_path: Path) -> None:
    pytest.importorskip("opentimelineio", reason="cuts need usdface[otio]")
    with pytest.raises(InputError, match=r"cut\.edl: No such file or directory$"):
        read_cut(tmp_path / "cut.edl")


def test_without_the_library_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "opentimelineio", None)
    with pytest.raises(PluginError, match=r"usdface\[otio\]"):
        read_cut(tmp_path / "cut.edl")
