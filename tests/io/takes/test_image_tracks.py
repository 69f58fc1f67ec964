"""The same tracks in the formats of all programs are the same take."""

import numpy as np
import pytest
from track_writers import HEIGHT, SIZE, TRACKS, WRITERS, expected_positions, write_shake

from usdface.errors import InputError
from usdface.io.takes.files import read_take
from usdface.io.takes.formats import TAKE_READERS
from usdface.options import TakeOptions

REFERENCES = {
    "ref_Mayalive.txt": (0.0, 1e-4),
    "ref_NukeCameraTrackerUsertracks.txt": (0.0, 1e-9),
    "ref_NukeScript.nk": (0.0, 1e-9),
    "ref_PFTrack5.2dt": (0.0, 1e-9),
    "ref_Syntheyes.txt": (0.0, 1e-3),  # six decimals of half an image
    "ref_boujou.txt": (-1.0, 1e-9),  # its writer counts rows from 1
    "ref_equalizer.txt": (0.0, 1e-9),
    "ref_matchmover.rz2": (0.0, 1e-9),
}


def codes(findings):
    return [found.code for found in findings]


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
@pytest.mark.parametrize("name", WRITERS)
def test_every_format_gives_the_same_take(tmp_path, name, line_end):
    writer = WRITERS[name]
    path = tmp_path / writer.file
    path.write_bytes(writer.write(TRACKS).replace("\n", line_end).encode())
    take, findings = read_take(path, TakeOptions(**writer.options))
    assert take.names == (writer.names("left brow"), writer.names("chin"))
    assert take.dimension == 2
    assert take.rate == 25
    np.testing.assert_allclose(take.times, np.arange(8) / 25, atol=1e-12)
    np.testing.assert_allclose(
        take.positions, expected_positions(TRACKS), atol=writer.tolerance, rtol=0
    )
    reported = codes(findings)
    assert ("MARKER_NEVER_SEEN" in reported) == writer.keeps_empty_tracks
    assert "RATE_ASSUMED" not in reported
    assert "IMAGE_SIZE_UNKNOWN" not in reported
    assert "FRAMES_RENUMBERED" not in reported


@pytest.mark.parametrize("name", WRITERS)
def test_one_reader_alone_knows_each_format(tmp_path, name):
    writer = WRITERS[name]
    path = tmp_path / writer.file
    path.write_text(writer.write(TRACKS))
    sure = [
        reader
        for reader in TAKE_READERS.built_in
        if reader.claims(path) and reader.recognises(path)
    ]
    alone = [r for r in TAKE_READERS.built_in if r.claims(path)]
    assert len(sure) == 1 or len(alone) == 1


@pytest.mark.parametrize("name", REFERENCES)
def test_the_reference_files_of_all_programs_are_one_take(shared_data, name):
    lift, tolerance = REFERENCES[name]
    path = shared_data / "tracks_2d" / name
    if not path.is_file():
        pytest.skip(f"no real data: {path}")
    frames = np.array([*range(10), *range(12, 21)])
    take, _ = read_take(path, TakeOptions(rate=25.0, image_size=(1920, 1080)))
    np.testing.assert_allclose(take.times * 25, frames, atol=1e-9)
    x = 96.0 * frames
    y = 1080 * (1 - (1 - frames / 10) ** 2)  # from the top
    np.testing.assert_allclose(take.positions[:, 0, 0], x, atol=tolerance)
    np.testing.assert_allclose(take.positions[:, 0, 1], lift - y, atol=tolerance)
    np.testing.assert_allclose(take.positions[:, 1, 0], 1920 - x, atol=tolerance)
    np.testing.assert_allclose(take.positions[:, 1, 1], lift - 1080 + y, atol=tolerance)
    np.testing.assert_allclose(take.positions[0, 2], [970, lift - 530], atol=tolerance)
    assert take.visible[:, 2].sum() == 1


def test_every_real_sample_is_read(shared_data):
    folder = shared_data / "tracks_2d"
    if not folder.is_dir():
        pytest.skip(f"no real data: {folder}")
    markers = {
        "3de_export_cube.txt": 8,
        "3de_export_v3.txt": 39,
        "boujou_txt_export.txt": 20,
        "cola_plate.txt": 6,
        "kipPointsMatchmover.rz2": 5,
        "mayalive_kipShot.txt": 18,
        "nuke7_tracker_2tracks.nk": 2,
        "nuke8_tracker4_copypastes.nk": 4,
        "one_shake_tracker_from_first.txt": 1,
        "pfmatchit_example.2dt": 1,
        "two_shake_trackers.txt": 2,
        "tracker_with_differing_gaps.nk": 1,
    }
    for name, count in markers.items():
        take, _ = read_take(folder / name, TakeOptions(rate=25.0, image_size=(1920, 1080)))
        assert len(take.names) == count, name


def test_without_the_size_of_the_image_y_is_counted_from_its_lower_edge(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text(write_shake(TRACKS))
    take, findings = read_take(path, TakeOptions(rate=25.0))
    expected = expected_positions(TRACKS) + np.array([0.0, HEIGHT])
    np.testing.assert_allclose(take.positions, expected, atol=1e-4)
    assert take.image_size is None
    assert "IMAGE_SIZE_UNKNOWN" in codes(findings)


@pytest.mark.parametrize("name", ["syntheyes", "mmsolver 1", "mediapipe csv"])
def test_parts_of_an_image_need_its_size(tmp_path, name):
    path = tmp_path / WRITERS[name].file
    path.write_text(WRITERS[name].write(TRACKS))
    with pytest.raises(InputError, match="give --image-size WIDTH HEIGHT") as raised:
        read_take(path)
    assert raised.value.code == "SETTING_WRONG"


def test_pixels_where_parts_of_the_image_are_expected_are_refused(tmp_path):
    path = tmp_path / "a.uv"
    path.write_text("1\na\n1\n1 640.5 300.0 1\n")
    with pytest.raises(InputError, match=r"reach 640\.5; expected parts of the image"):
        read_take(path, TakeOptions(image_size=SIZE))


@pytest.mark.parametrize(("threshold", "seen"), [(None, True), (0.5, True), (0.95, False)])
def test_samples_below_the_asked_confidence_are_occluded(tmp_path, threshold, seen):
    tracks = {"sure": {0: (1.0, 2.0)}, "doubtful": {0: (3.0, 4.0)}}
    path = tmp_path / "a.txt"
    path.write_text(
        write_shake({"sure": tracks["sure"]}, 0.99) + write_shake({"doubtful": tracks["doubtful"]})
    )
    take, findings = read_take(path, TakeOptions(rate=25.0, confidence=threshold))
    assert ("doubtful" in take.names) == seen
    assert ("CONFIDENCE_LOW" in codes(findings)) == (not seen)


def test_a_format_without_confidence_refuses_a_threshold(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text(WRITERS["3de4"].write(TRACKS))
    with pytest.raises(InputError, match=r"has no use for confidence = 0\.5"):
        read_take(path, TakeOptions(confidence=0.5))


def test_a_confidence_is_a_share():
    with pytest.raises(InputError, match="'confidence' is 60"):
        TakeOptions(confidence=60)


@pytest.mark.parametrize("name", WRITERS)
def test_frames_before_the_first_sample_are_counted_alike(tmp_path, name):
    writer = WRITERS[name]
    path = tmp_path / writer.file
    late = {label: {f + 40: place for f, place in TRACKS[label].items()} for label in TRACKS}
    path.write_text(writer.write(late))
    take, _ = read_take(path, TakeOptions(**writer.options))
    first = int(np.argmax(take.visible.any(axis=1)))  # some write rows without a face before
    assert take.first_frame + first == 40
    assert round(take.times[first] * 25) == first


def test_a_take_that_begins_later_says_so(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text(write_shake({"a": {40: (1.0, 2.0), 41: (1.0, 2.0)}}))
    take, findings = read_take(path, TakeOptions(rate=25.0))
    assert take.times.tolist() == [0, 0.04]
    assert [f.values["frame_number"] for f in findings if f.code == "FRAMES_RENUMBERED"] == [41]


@pytest.mark.parametrize(
    ("file", "text", "words"),
    [
        (
            "a.txt",
            "TrackName a\n1 2 3 1\n1 2 4 1\n",
            "line 3: track 'a' has a second sample in frame 1",
        ),
        ("a.txt", "TrackName a\nnan 2 3 1\n", "line 2: there is no frame number"),
        ("a.txt", "TrackName a\n1 2 3\n", "line 2: 3 values; expected 4 or more"),
        ("a.txt", "TrackName a\n1 2 b 1\n", "line 2, column 3: 'b' is not a number"),
        ("a.txt", "TrackName a\nTrackName b\n", "no track has a sample"),
        ("a.txt", "2\na\n0\n2\n1 1 1\n", "ends within track 'a': 1 of 2 samples"),
        ("a.txt", "2\na\n0\n1\n1 1 1\n", "2 points are announced, 1 are there"),
        ("a.txt", "1\na\n0\n1\n1 1 1\nb\n", "line 6: text after the 1 points"),
        ("a.uv", "3000000000\na\n", "expected the number of points, a whole number"),
        ("a.uv", "999999999\na\n999999999\n1 1 1 1\n", "ends within track 'a': 1 of 999999999"),
        ("a.uv", '{"version": 9}', "version '9'; expected 2 to 5"),
        ("a.uv", '{"version": 2, "points": [3]}', "expected a list of points"),
        ("a.uv", "{", "is no JSON"),
        ("a.2dt", '"a"\n"Primary"\n3\n1 1 1 1\n', "ends within track 'a'"),
        ("a.2dt", '"a"\n"Primary"\nmany\n', "line 3: 'many'; expected the samples of track 'a'"),
        ("a.rz2", "pointTrack\n", "expected imageSequence"),
        ("a.rz2", 'imageSequence "a"\n{\n', "the block does not end"),
        ("a.rz2", 'imageSequence "a"\n{\n}\n', "the image sequence has no size"),
        ("a.nk", "Tracker3 {\n", "1 braces do not close"),
        ("a.nk", "}", "a brace closes that was not opened"),
        ("a.nk", "{" * 100, "more than 64 braces in braces"),
        ("a.nk", "Blur {\n size 3\n}\n", "there is no animated track"),
        ("a.json", "[]", "no frame has landmarks"),
        ("a.json", '{"a": 3}', "one as 'frames'; found an object without one"),
        ("a.json", "3", "one as 'frames'; found 3"),
        ("a.csv", "scorer,n\nbodyparts,a\ncoords,x\n0,1\n", "'a' has no column x or y"),
        ("a.csv", "scorer,n\nbodyparts,a\n0,1\n", "the header has no row coords"),
        ("a.csv", "track,frame_idx,instance.score,a.x\n,0,1,2\n", "there is no column a.y"),
        ("a.csv", "frame,timestamp,confidence,success\n1,0,1,1\n", "there is no column x_0"),
        ("a.csv", "scorer,n\nbodyparts,a,a\ncoords,x,y\n", "there are no frames of data"),
        ("a.csv", "track,frame_idx,instance.score,a.x,a.y\n", "there are no frames of data"),
        ("a.csv", "frame, confidence, success, x_0, y_0\n", "there are no frames of data"),
    ],
)
def test_bad_files_are_one_clear_line(tmp_path, file, text, words):
    path = tmp_path / file
    path.write_text(text)
    with pytest.raises(InputError) as raised:
        read_take(path, TakeOptions(image_size=SIZE))
    assert words in str(raised.value)
    assert "\n" not in str(raised.value)
