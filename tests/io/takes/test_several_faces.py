"""Films with a passer-by: the face that is read is the performer's, and the others are reported."""

import json

import numpy as np
import pytest

from usdface.io.takes.files import read_take
from usdface.io.takes.mediapipe import read_mediapipe
from usdface.io.takes.several_faces import follow_faces
from usdface.options import TakeOptions

OPTIONS = TakeOptions(rate=25.0, image_size=(100, 100))
PERFORMER, PASSER_BY = 10.0, 70.0  # px, of x


def left_out(findings):
    return [found for found in findings if found.code == "FACES_LEFT_OUT"]


def openface(tmp_path, *rows):
    """Rows of frame, face, success and x."""
    header = "frame, face_id, timestamp, confidence, success, x_0, y_0"
    lines = [f"{n}, {face}, {n / 25}, 0.9, {good}, {x}, 30" for n, face, good, x in rows]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


def test_a_passer_by_in_the_first_images_is_not_taken_for_the_performer(tmp_path):
    rows = [(1, 0, 1, PASSER_BY), *((n, 1, 1, PERFORMER) for n in range(1, 6))]
    take, findings = read_take(openface(tmp_path, *rows))
    np.testing.assert_allclose(take.positions[:, 0, 0], [PERFORMER + 0.5] * 5)
    (found,) = left_out(findings)
    assert dict(found.values) == {"face": "face 1", "face_count": 2, "frame_count": 5}
    assert "left out: face 0 (1)" in found.message


def test_frames_in_which_a_face_is_lost_do_not_count(tmp_path):
    rows = [(n, 0, int(n == 1), PASSER_BY) for n in range(1, 6)]
    rows += [(n, 1, 1, PERFORMER) for n in (1, 2)]
    take, _ = read_take(openface(tmp_path, *rows))
    assert take.positions[0, 0, 0] == PERFORMER + 0.5


def test_of_faces_that_are_seen_equally_often_the_first_is_read(tmp_path):
    rows = [(1, 0, 1, PERFORMER), (1, 1, 1, PASSER_BY)]
    take, findings = read_take(openface(tmp_path, *rows))
    assert take.positions[0, 0, 0] == PERFORMER + 0.5 and left_out(findings)


def test_a_face_that_is_found_again_under_another_number_is_pointed_out(tmp_path):
    rows = [(n, 0, 1, PERFORMER) for n in range(1, 4)]
    rows += [(n, 1, 1, PERFORMER) for n in (5, 6)] + [(2, 2, 1, PASSER_BY)]
    (found,) = left_out(read_take(openface(tmp_path, *rows))[1])
    assert "if face 1 is the same person, found again, give both one number" in found.message


def two_landmarks(tmp_path, *rows):
    """Rows of frame, face, success, x and width of the face: one of two landmarks."""
    header = "frame, face_id, timestamp, confidence, success, x_0, x_1, y_0, y_1"
    lines = [
        f"{n}, {face}, {n / 25}, 0.9, {good}, {x}, {x + wide}, 30, 30"
        for n, face, good, x, wide in rows
    ]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


def test_a_face_that_is_found_again_at_its_place_is_joined(tmp_path):
    """Under a new number each time; together the performer is seen longer than the passer-by."""
    rows = [(n, 0, 1, PERFORMER, 20) for n in (1, 2)] + [(3, 0, 0, PERFORMER, 20)]
    rows += [(n, 4, 1, PERFORMER + 3, 21) for n in (4, 5)] + [(5, 0, 0, PERFORMER, 20)]
    rows += [(n, 7, 1, PERFORMER + 5, 20) for n in (7, 8)]
    rows += [(n, 1, 1, PASSER_BY, 20) for n in (4, 5, 6, 7, 8)]
    take, findings = read_take(two_landmarks(tmp_path, *rows))
    x = np.array([0, 0, np.nan, 3, 3, 5, 5]) + PERFORMER + 0.5  # no row for frame 6
    np.testing.assert_allclose(take.positions[:, 0, 0], x)
    (joined,) = [found for found in findings if found.code == "FACES_JOINED"]
    assert dict(joined.values) == {"face": "face 0", "names": ["face 4", "face 7"]}
    (found,) = left_out(findings)
    assert dict(found.values) == {"face": "face 0", "face_count": 2, "frame_count": 6}


def test_the_faces_of_most_frames_are_joined_however_many_there_are(tmp_path):
    rows = [(n, 0, 1, PERFORMER, 20) for n in range(1, 4)]
    rows += [(n, n, 1, PASSER_BY + 40 * n, 20) for n in range(4, 100)]
    rows += [(n, 100, 1, PERFORMER, 20) for n in range(100, 103)]
    take, findings = read_take(two_landmarks(tmp_path, *rows))
    assert len(take.times) == 6
    (joined,) = [found for found in findings if found.code == "FACES_JOINED"]
    assert joined.values["names"] == ["face 100"]


@pytest.mark.parametrize(
    "again", [(5, 1, 1, PERFORMER + 15, 20), (5, 1, 1, PERFORMER, 40), (3, 1, 1, PERFORMER, 20)]
)
def test_a_face_elsewhere_or_of_another_size_or_beside_it_is_not_joined(tmp_path, again):
    rows = [(n, 0, 1, PERFORMER, 20) for n in range(1, 4)]
    take, findings = read_take(two_landmarks(tmp_path, *rows, again))
    assert len(take.times) == 3 and left_out(findings)
    assert "FACES_JOINED" not in [found.code for found in findings]


def test_one_face_needs_no_finding(tmp_path):
    _, findings = read_take(openface(tmp_path, (1, 0, 1, PERFORMER), (2, 0, 1, PERFORMER)))
    assert not left_out(findings)


@pytest.mark.parametrize("column", ["face", "face_id", "face_index"])
def test_a_table_of_mediapipe_with_several_faces(tmp_path, column):
    rows = [f"{n},{face},{mark},{x / 100},0.3" for n in range(3) for mark in (0, 1)
            for face, x in ((0, PASSER_BY), (1, PERFORMER)) if face or n == 0]  # fmt: skip
    path = tmp_path / "a.csv"
    path.write_text("\n".join([f"frame,{column},landmark,x,y", *rows]) + "\n")
    take, findings = read_take(path, OPTIONS)
    np.testing.assert_allclose(take.positions[..., 0], PERFORMER)
    assert dict(left_out(findings)[0].values)["frame_count"] == 3


@pytest.mark.parametrize("nobody", ["", "-1", "-1.0", "nan"])
@pytest.mark.parametrize("others", [0, 1])
def test_frames_in_which_nobody_is_seen_are_of_no_other_face(tmp_path, nobody, others):
    """A row without a face says that none was found there."""
    rows = [f"{n},0,0.1,0.3" for n in (0, 2, 3)] + [f"{n},{nobody},," for n in (1, 4)]
    rows += [f"{n},1,0.7,0.3" for n in (1, 3)] * others
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["frame,face,x_0,y_0", *rows]) + "\n")
    take, findings = read_mediapipe(path, OPTIONS)
    np.testing.assert_allclose(
        take.positions[:, 0, 0], [PERFORMER, np.nan, PERFORMER, PERFORMER, np.nan]
    )
    assert [found.values["face_count"] for found in left_out(findings)] == [2] * others


def test_a_number_without_any_place_is_no_face(tmp_path):
    """As in a table whose column `face` tells whether one is found."""
    rows = [f"{n},{int(n != 2)},{0.1 if n != 2 else ''},{0.3 if n != 2 else ''}" for n in range(5)]
    rows += ["2,9,,"]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["frame,face,x_0,y_0", *rows]) + "\n")
    take, findings = read_mediapipe(path, OPTIONS)
    x = [PERFORMER, PERFORMER, np.nan, PERFORMER, PERFORMER]
    np.testing.assert_allclose(take.positions[:, 0, 0], x)
    assert not left_out(findings)


def test_frames_without_numbers_are_reported_where_some_may_have_no_row(tmp_path):
    def codes(header, *rows):
        path = tmp_path / "a.csv"
        path.write_text("\n".join([header, *rows]) + "\n")
        take, findings = read_mediapipe(path, TakeOptions(image_size=(100, 100)))
        return take, {found.code for found in findings}

    assert "FRAMES_UNNUMBERED" in codes("face,x_0,y_0", "0,0.1,0.3", "0,0.2,0.3")[1]
    both = "0,0.1,0.3", "1,0.7,0.3", "0,0.1,0.3", "-1,,"
    assert "FRAMES_UNNUMBERED" in codes("face,x_0,y_0", *both)[1]
    # Frames without a face have a row, or all have a number: nothing closes up.
    assert "FRAMES_UNNUMBERED" not in codes("face,x_0,y_0", "0,0.1,0.3", "-1,,")[1]
    assert "FRAMES_UNNUMBERED" not in codes("frame,face,x_0,y_0", "0,0,0.1,0.3")[1]
    timed = "0,0,0.1,0.3", "0,1,0.7,0.3", "40,0,0.1,0.3", "120,0,0.1,0.3"
    take, found = codes("timestamp_ms,face,x_0,y_0", *timed)
    np.testing.assert_allclose(take.times, [0.0, 0.04, 0.12])
    assert "FRAMES_UNNUMBERED" not in found


def test_faces_of_one_time_are_of_one_frame(tmp_path):
    path = tmp_path / "a.csv"
    rows = "0,0,0.1,0.3", "0,1,0.7,0.3", "40,0,0.1,0.3"
    path.write_text("\n".join(["timestamp_ms,face,x_0,y_0", *rows]) + "\n")
    (found,) = left_out(read_mediapipe(path, TakeOptions(image_size=(100, 100)))[1])
    assert "same person" not in found.message


def test_faces_that_are_never_tracked_are_one_that_is_not(tmp_path):
    rows = [(n, face, int(face == 0 and n < 3), PERFORMER) for n in range(5) for face in (0, 1)]
    take, findings = read_take(openface(tmp_path, *rows))
    assert np.isnan(take.positions[:, 0, 0]).tolist() == [False] * 3 + [True] * 2
    assert not left_out(findings)


@pytest.mark.parametrize(
    "header", ["frame,timestamp_ms,landmark,x,y", "timestamp_ms,frame,x_0,y_0"]
)
def test_times_of_a_table_of_mediapipe_give_its_rate(tmp_path, header):
    wide = "x_0" in header
    rows = [f"{40 * n},{n},0.5,0.5" if wide else f"{n},{40 * n},0,0.5,0.5" for n in range(4)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    take, findings = read_mediapipe(path, TakeOptions(image_size=(100, 100)))
    assert take.rate == 25
    np.testing.assert_allclose(take.times, [0, 0.04, 0.08, 0.12])
    assert "RATE_ASSUMED" not in [found.code for found in findings]


def face(x):
    return [{"x": x / 100, "y": 0.3}, {"x": x / 100, "y": 0.4}]


def test_faces_that_mediapipe_lists_in_another_order_are_followed(tmp_path):
    both = [[face(PERFORMER + n), face(PASSER_BY - n)] for n in range(6)]
    frames = [own[::-1] if n in (2, 3) else own for n, own in enumerate(both)]
    frames += [[face(PERFORMER + 6)], []]
    path = tmp_path / "a.json"
    path.write_text(json.dumps([{"face_landmarks": own} for own in frames]))
    take, findings = read_take(path, OPTIONS)
    expected = [*(PERFORMER + np.arange(7.0)), np.nan]
    np.testing.assert_allclose(take.positions[:, 0, 0], expected)
    (found,) = left_out(findings)
    assert "face 0 (first at 0.10, 0.35 of frame 0) (7 frames)" in found.message


def read_frames(tmp_path, *frames):
    path = tmp_path / "a.json"
    path.write_text(json.dumps([{"face_landmarks": own} for own in frames]))
    take, findings = read_take(path, OPTIONS)
    return take.positions[:, 0, 0], [found.values for found in left_out(findings)]


def test_a_passer_by_who_is_seen_alone_is_not_the_performer(tmp_path):
    """The performer is lost for an image: the one that is still there is far from that place."""
    one, other = face(PERFORMER), face(PASSER_BY)
    x, (found,) = read_frames(tmp_path, [one], [other], [other, one], [one], [one])
    np.testing.assert_allclose(x, [PERFORMER, np.nan, *[PERFORMER] * 3])
    assert (found["face_count"], found["frame_count"]) == (2, 4)


def test_a_performer_who_comes_back_elsewhere_is_the_same(tmp_path):
    """As where nobody else is seen in the film."""
    one, other, back = face(PERFORMER), face(PASSER_BY), face(40.0)
    x, (found,) = read_frames(tmp_path, [one, other], [one], [one], [], [back], [back])
    np.testing.assert_allclose(x, [*[PERFORMER] * 3, np.nan, 40.0, 40.0])
    assert (found["face_count"], found["frame_count"]) == (2, 5)


@pytest.mark.parametrize("nothing", [None, 1e308])
def test_a_face_without_a_place_is_none(tmp_path, nothing):
    empty = [{"x": nothing, "y": nothing}] * 2
    if nothing is None:
        x, found = read_frames(tmp_path, [face(PERFORMER), empty], [empty], [face(PERFORMER)])
        np.testing.assert_allclose(x, [PERFORMER, np.nan, PERFORMER])
        assert not found
    else:  # far away is a place
        x, found = read_frames(tmp_path, [face(PERFORMER), empty], [face(PERFORMER)])
        np.testing.assert_allclose(x, [PERFORMER] * 2)
        assert found


def test_landmarks_that_a_face_lacks_do_not_count_for_its_place(tmp_path):
    half = [face(PERFORMER)[0], {"x": None, "y": None}]
    both = [face(PERFORMER), face(PASSER_BY)]
    x, (found,) = read_frames(tmp_path, both, [half], [half], [half])
    np.testing.assert_allclose(x, [PERFORMER] * 4)
    assert found["face_count"] == 2


def test_a_person_keeps_a_number_while_out_of_sight():
    a, b = np.array([0.1, 0.5]), np.array([0.9, 0.5])
    frames = [[a], [b, a], [b], [], [a, b], [a + 0.05]]
    sizes = [[0.2] * len(own) for own in frames]
    assert follow_faces(frames, sizes) == [[0], [1, 0], [1], [], [0, 1], [0]]
