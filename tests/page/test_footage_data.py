import numpy as np

from usdface.page.footage_data import face_box, footage_data, images_of_frames, shown_frames
from usdface.takes import MarkerTake


def film(count: int) -> MarkerTake:
    places = np.tile([[100.0, -50.0], [200.0, -150.0]], (count, 1, 1))
    places[:, 0, 0] += np.arange(count)
    places[1, 1] = np.nan
    return MarkerTake(("chin", "nose"), np.arange(count) / 30, places, 30.0, image_size=(210, 400))


def test_frames_are_spread_from_the_first_to_the_last() -> None:
    assert shown_frames(film(3)) == [0, 1, 2]
    many = shown_frames(film(1000))
    assert len(many) == 24 and many[0] == 0 and many[-1] == 999


def test_the_box_is_around_the_dots_and_within_the_images() -> None:
    left, top, right, bottom = face_box(film(3))
    assert (right, bottom) == (210, 172) and 70 < left < 100 and 20 < top < 50


def test_dots_are_in_pixels_of_the_image_with_their_confidence() -> None:
    data = footage_data(film(3), {0: b"a", 1: b"b"}, (0, 0, 210, 400), {"chin": [0.1, 0.9, 1.0]})
    assert data["names"] == ["chin", "nose"]
    assert [each["frame"] for each in data["frames"]] == [0, 1]
    assert data["frames"][0]["dots"] == [[100.0, 50.0, 0.1], [200.0, 150.0, None]]
    assert data["frames"][1]["dots"] == [[101.0, 50.0, 0.9], None]
    assert data["frames"][0]["image"] == "data:image/jpeg;base64,YQ=="


def test_tracks_may_begin_later_than_the_footage_and_leave_frames_out() -> None:
    places = np.ones((3, 1, 2))
    tracks = MarkerTake(("a",), np.array([0.0, 0.04, 0.2]), places, 25.0, first_frame=7)
    assert images_of_frames(tracks).tolist() == [7, 8, 12]


def test_a_take_of_images_has_a_frame_for_each_at_changing_rates() -> None:
    times, diameters = np.array([0.0, 0.05, 0.06]), np.ones(1)
    film = MarkerTake(("a",), times, np.ones((3, 1, 2)), 30.0, diameters=diameters)
    assert images_of_frames(film).tolist() == [0, 1, 2]
