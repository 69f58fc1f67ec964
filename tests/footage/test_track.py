from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from painted import performance

from usdface.arrays import BoolArray, FloatArray
from usdface.errors import InputError
from usdface.footage.dots import Dots, no_dots
from usdface.footage.fixes import Fix
from usdface.footage.labels import DotName
from usdface.footage.track import reference_frame, track_dots
from usdface.footage.tracks import Tracks


def seen_as(places: FloatArray, seen: BoolArray, noise: float = 0.05) -> list[Dots]:
    """Dots as the detector would find them, in any order."""
    random = np.random.default_rng(4)
    frames = []
    for row, visible in zip(places, seen, strict=True):
        own = row[visible][random.permutation(int(visible.sum()))]
        count = len(own)
        full, pairs = np.ones(count), np.full((count, 2), 5.0)
        own = own + random.normal(0, noise, own.shape)
        sizes = (78.0 * full, full, 90.0 * full)
        frames.append(Dots(own, 0.05 * full, pairs, 0 * full, *sizes, faint=0 * full > 0))
    return frames


def labels_of(tracks: Tracks, places: FloatArray) -> FloatArray:
    """The true dot of each sample (F, M); -1 = hidden."""
    away = np.linalg.norm(tracks.places[:, :, None] - places[:, None], axis=3)
    nearest = np.argmin(np.nan_to_num(away, nan=1e9), axis=2)
    return np.where(np.isnan(tracks.places[..., 0]), -1, nearest)


def check(tracks: Tracks, places: FloatArray, seen: BoolArray) -> None:
    labels = labels_of(tracks, places)
    own = labels[tracks.reference]
    assert sorted(own) == list(range(places.shape[1]))
    assert np.array_equal(labels >= 0, seen[:, own])
    assert (np.where(labels >= 0, labels, own) == own).all()


def test_every_dot_keeps_its_name_while_the_head_moves() -> None:
    places, seen = performance(60)
    check(track_dots(seen_as(places, seen)), places, seen)


def test_hidden_is_hidden_and_a_dot_that_comes_back_is_the_same() -> None:
    places, seen = performance(90, {3: (20, 32), 4: (25, 60), 11: (40, 48), 12: (40, 48)})
    check(track_dots(seen_as(places, seen)), places, seen)


def test_a_dot_that_the_reference_does_not_show_becomes_a_marker() -> None:
    places, seen = performance(80, {5: (0, 30), 9: (50, 79)})
    seen[31:50, 2] = False
    tracks = track_dots(seen_as(places, seen))
    assert len(tracks.names) == places.shape[1]
    labels = labels_of(tracks, places)
    for column in labels.T:
        assert len(set(column[column >= 0].tolist())) == 1


def test_a_head_that_jumps_by_more_than_a_spacing_is_followed() -> None:
    places, seen = performance(40)
    places[20:] += (55.0, -20.0)
    check(track_dots(seen_as(places, seen)), places, seen)


def test_a_cut_to_a_nearer_picture_is_found_and_names_go_on() -> None:
    places, seen = performance(40, motion=0.5)
    places[20:] = 1.4 * places[20:] + (300.0, 200.0)
    tracks = track_dots(seen_as(places, seen))
    check(tracks, places, seen)
    assert tracks.cuts == (20,)


def test_frames_without_dots_are_bridged() -> None:
    places, seen = performance(40, motion=0.4)
    seen[15:18] = False
    check(track_dots(seen_as(places, seen)), places, seen)


@pytest.mark.slow
def test_stray_specks_are_no_markers() -> None:
    places, seen = performance(50)
    frames = seen_as(places, seen)
    random = np.random.default_rng(0)
    spoilt = []
    for dots in frames:
        extra = random.uniform((0, 0), (280, 220), (2, 2))
        ones, pair = np.ones(2), np.full((2, 2), 5.0)
        parts = (extra, 0.05 * ones, pair, 0 * ones, 78.0 * ones, ones, 90.0 * ones, 0 * ones)
        names = Dots.__slots__
        spoilt.append(
            Dots(
                *(np.concatenate([getattr(dots, n), p]) for n, p in zip(names, parts, strict=True))
            )
        )
    tracks = track_dots(spoilt)
    labels = labels_of(tracks, places)
    away = np.linalg.norm(
        tracks.places - np.take_along_axis(places, labels[..., None], axis=1), axis=2
    )
    assert len(tracks.names) == places.shape[1]
    assert np.nanmean(away < 1.0) > 0.99


def faint_now_and_then(frames: list[Dots], places: FloatArray, dot: int) -> list[Dots]:
    """A dot whose colour is hardly its own in every third image from the tenth on."""
    return [
        replace(
            dots,
            faint=(np.linalg.norm(dots.centres - row[dot], axis=1) < 3)
            & (number in range(9, 60, 3)),
        )
        for number, (dots, row) in enumerate(zip(frames, places, strict=True))
    ]


def test_a_track_goes_on_with_faint_dots() -> None:
    places, seen = performance(60)
    check(track_dots(faint_now_and_then(seen_as(places, seen), places, 7)), places, seen)


def test_faint_dots_alone_are_no_marker() -> None:
    places, seen = performance(60)
    frames = [
        replace(dots, faint=np.linalg.norm(dots.centres - row[7], axis=1) < 3)
        for dots, row in zip(seen_as(places, seen), places, strict=True)
    ]
    tracks = track_dots(frames)
    assert len(tracks.names) == places.shape[1] - 1
    assert not (labels_of(tracks, places) == 7).any()


def test_faint_dots_do_not_choose_the_reference() -> None:
    places, seen = performance(60)
    seen[:30, 3] = False
    frames = [
        replace(dots, faint=np.full(len(dots), number >= 30))
        for number, dots in enumerate(seen_as(places, seen))
    ]
    assert reference_frame(frames) < 30


def test_dots_are_as_large_as_they_usually_are() -> None:
    places, seen = performance(40)
    frames = seen_as(places, seen)
    stretched = [
        replace(dots, axes=np.where(number % 4, dots.axes, [9.0, 3.0]))
        for number, dots in enumerate(frames)
    ]
    assert track_dots(stretched).diameter == 10.0


def test_dots_that_exchange_places_slowly_are_followed() -> None:
    places, seen = performance(60, motion=0.3)
    a, b = places[:, 6].copy(), places[:, 7].copy()
    share = np.clip((np.arange(60) - 20) / 20, 0, 1)[:, None]
    bow = np.sin(np.pi * share) * (0.0, 12.0)
    places[:, 6], places[:, 7] = a + share * (b - a) + bow, b + share * (a - b) - bow
    check(track_dots(seen_as(places, seen)), places, seen)


def test_names_go_to_the_dots_that_they_are_near() -> None:
    places, seen = performance(30)
    named = [DotName("chin", *(places[10, 17] + 2.0), frame=10)]
    named.append(DotName("nowhere", 500.0, 500.0, frame=10))
    tracks = track_dots(seen_as(places, seen), named)
    column = tracks.names.index("chin")
    assert np.abs(tracks.places[:, column] - places[:, 17]).max() < 0.5
    assert tracks.unmatched == ("nowhere",)
    assert len(set(tracks.names)) == len(tracks.names) == 20


@pytest.mark.slow
def test_a_correction_holds_from_its_frame_on() -> None:
    places, seen = performance(60)
    frames = seen_as(places, seen)
    named = [DotName("a", *places[0, 6]), DotName("b", *places[0, 7])]
    fixes = [Fix(30, "a", tuple(places[30, 7])), Fix(30, "b", tuple(places[30, 6]))]
    tracks = track_dots(frames, named, fixes)
    a, b = tracks.names.index("a"), tracks.names.index("b")
    assert np.abs(tracks.places[:30, a] - places[:30, 6]).max() < 0.5
    assert np.abs(tracks.places[30:, a] - places[30:, 7]).max() < 0.5
    assert np.abs(tracks.places[30:, b] - places[30:, 6]).max() < 0.5


def test_a_correction_can_hide_a_dot_and_one_beside_all_dots_is_reported() -> None:
    places, seen = performance(30)
    named = [DotName("a", *places[0, 6])]
    fixes = [Fix(12, "a", None), Fix(20, "a", (1.0, 1.0))]
    tracks = track_dots(seen_as(places, seen), named, fixes)
    hidden = np.isnan(tracks.places[:, tracks.names.index("a"), 0])
    assert np.flatnonzero(hidden).tolist() == [12]
    assert tracks.unmatched == ("a, frame 20",)


@pytest.mark.parametrize(
    ("fix", "message"),
    [(Fix(5, "chn", None), "did you mean chin"), (Fix(99, "chin", None), "frames 0 to 9")],
)
def test_corrections_of_nothing_are_refused(fix: Fix, message: str) -> None:
    places, seen = performance(10)
    with pytest.raises(InputError, match=message):
        track_dots(seen_as(places, seen), [DotName("chin", *places[0, 0])], [fix])


def empty_film() -> Sequence[Dots]:
    return [no_dots()] * 5


def test_a_film_without_dots_is_refused() -> None:
    with pytest.raises(InputError, match="no image shows"):
        track_dots(empty_film())


def test_one_image_is_a_film() -> None:
    places, seen = performance(1)
    tracks = track_dots(seen_as(places, seen))
    assert tracks.places.shape == (1, 20, 2) and (tracks.confidence > 0.9).all()


@pytest.mark.slow
@pytest.mark.parametrize("last", [35, 50])
@pytest.mark.parametrize(("fill", "shown"), [(0.99, True), (0.87, False)])
def test_a_dot_that_the_skin_stretches_is_shown_and_two_that_run_together_are_not(
    fill: float, shown: bool, last: int
) -> None:
    places, seen = performance(60)
    frames = seen_as(places, seen)
    for number in range(25, last):
        dots = frames[number]
        mine = np.linalg.norm(dots.centres - places[number, 5], axis=1).argmin()
        areas, fills = dots.areas.copy(), dots.fills.copy()
        areas[mine], fills[mine] = 2.6 * areas[mine], fill
        frames[number] = replace(dots, areas=areas, fills=fills)
    tracks = track_dots(frames)
    track = np.linalg.norm(tracks.places[0] - places[0, 5], axis=1).argmin()
    assert (~np.isnan(tracks.places[25:last, track, 0]) == shown).all()
    assert not np.isnan(tracks.places[[24, last], track]).any()


def test_a_dot_on_a_lid_that_closes_grows_and_is_followed() -> None:
    """It goes on by a spacing in five frames, stretched to nearly three times its area."""
    places, seen = performance(60)
    spacing = np.sort(np.linalg.norm(places[0] - places[0, 5], axis=1))[1]
    closed = np.clip((np.arange(60) - 20) / 5.0, 0.0, 1.0)
    places[:, 5, 1] += 0.8 * spacing * closed
    frames = seen_as(places, seen)
    for number, share in enumerate(closed.tolist()):
        dots = frames[number]
        mine = np.linalg.norm(dots.centres - places[number, 5], axis=1).argmin()
        areas, fills = dots.areas.copy(), dots.fills.copy()
        areas[mine], fills[mine] = (1.0 + 1.8 * share) * areas[mine], 0.98
        frames[number] = replace(dots, areas=areas, fills=fills)
    tracks = track_dots(frames)
    track = np.linalg.norm(tracks.places[0] - places[0, 5], axis=1).argmin()
    np.testing.assert_allclose(tracks.places[:, track], places[:, 5], atol=0.3)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.05, 0.2])
def test_deviations_are_those_of_the_places_that_jitter(noise: float) -> None:
    places, seen = performance(60)
    tracks = track_dots(seen_as(places, seen, noise))
    error = tracks.places - places[:, labels_of(tracks, places)[0]]
    # The dots state 0.05 px, as if the image had been compressed after that.
    ratio = np.sqrt(np.nanmean((error / tracks.deviations[..., None]) ** 2))
    assert 0.85 < ratio < 1.15
