import json

import numpy as np
import pytest
from track_writers import SIZE, TRACKS, expected_positions, write_uv4

from usdface.errors import InputError
from usdface.io.takes.mmsolver import read_mmsolver
from usdface.options import TakeOptions


@pytest.fixture
def read(tmp_path):
    def read(document, **options):
        path = tmp_path / "a.uv"
        path.write_text(json.dumps(document))
        return read_mmsolver(path, TakeOptions(rate=25.0, **options))

    return read


@pytest.mark.parametrize("version", [2, 3, 4, 5])
def test_every_version_is_read(read, version):
    document = json.loads(write_uv4(TRACKS, version))
    if version < 4:
        del document["camera"]
    take, _ = read(document, image_size=SIZE)
    np.testing.assert_allclose(take.positions, expected_positions(TRACKS), atol=1e-6)


def test_the_size_of_the_options_goes_before_that_of_the_file(read):
    take, _ = read(json.loads(write_uv4(TRACKS)), image_size=(960, 540))
    np.testing.assert_allclose(take.positions, expected_positions(TRACKS) / 2, atol=1e-6)


def test_distorted_places_are_read_where_there_are_no_others(read):
    sample = {"frame": 1, "pos_dist": [0.5, 0.5], "weight": 1.0}
    take, _ = read(
        {"version": 3, "points": [{"name": "a", "per_frame": [sample]}]}, image_size=SIZE
    )
    np.testing.assert_allclose(take.positions[0, 0], [960, -540])


def test_a_sample_without_weight_counts_is_occluded(read):
    samples = [{"frame": f, "pos": [0.5, 0.5], "weight": w} for f, w in enumerate((1.0, 0.0, 0.2))]
    document = {"version": 2, "points": [{"name": "a", "per_frame": samples}]}
    take, _ = read(document, image_size=SIZE)
    assert take.visible[:, 0].tolist() == [True, False, True]
    take, _ = read(document, image_size=SIZE, confidence=0.5)
    assert take.visible[:, 0].tolist() == [True, False, False]


@pytest.mark.parametrize(("lengths", "focal"), [((5.0, 5.0), 5 / 2.4 * 1920), ((5.0, 6.0), 0)])
def test_a_focal_length_that_stays_is_that_of_the_take(read, lengths, focal):
    document = json.loads(write_uv4(TRACKS))
    frames = [{"frame": n, "focal_length_cm": each} for n, each in enumerate(lengths)]
    document["camera"] |= {"film_back_cm": [2.4, 1.35], "per_frame": frames}
    take, findings = read(document)
    np.testing.assert_allclose(take.focal_length, focal)
    (lost,) = [f.values["channels"] for f in findings if f.code == "CHANNEL_IGNORED"]
    changing = [] if focal else ["a focal length that changes"]
    assert lost == ["set_name", "pos_dist", *changing]


def test_text_after_the_announced_points_is_refused(tmp_path):
    path = tmp_path / "a.uv"
    path.write_text("1\na\n1\n1 0.5 0.5 1.0\nb\n1\n1 0.5 0.5 1.0\n")
    with pytest.raises(InputError, match="text after the 1 points that are announced"):
        read_mmsolver(path, TakeOptions(image_size=(640, 480)))
