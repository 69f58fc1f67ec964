import numpy as np
import pytest
from track_writers import HEIGHT, SIZE, TRACKS, WIDTH, expected_positions

from usdface.errors import InputError
from usdface.io.takes.files import read_take
from usdface.options import TakeOptions


@pytest.fixture
def folder(tmp_path):
    return tmp_path


def write(folder, head="", frames=True, nan=False):
    for name, track in TRACKS.items():
        if not track:
            continue
        lines = [head] if head else []
        for f in range(8):
            place = track.get(f)
            if place is None and not nan:
                continue
            u, v = (place[0] / WIDTH, 1 - place[1] / HEIGHT) if place else ("nan", "nan")
            lines.append(f"{f + 1},{u},{v}" if frames else f"{u},{v}")
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize(
    "form",
    [{}, {"head": "frame,x,y"}, {"nan": True}, {"frames": False, "nan": True, "head": "x,y"}],
)
def test_a_folder_has_a_table_for_each_track(folder, form):
    write(folder, **form)
    # What macOS leaves beside a file on drives of other systems.
    (folder / "._chin.csv").write_bytes(b"\0\5\x16\7Mac OS X")
    take, _ = read_take(folder, TakeOptions(rate=25.0, image_size=SIZE))
    assert take.names == ("chin", "left brow")
    np.testing.assert_allclose(take.positions[:, ::-1], expected_positions(TRACKS), atol=1e-6)


def test_the_size_of_the_image_is_needed(folder):
    write(folder)
    with pytest.raises(InputError, match="--image-size"):
        read_take(folder)


def test_a_folder_with_other_files_is_none_of_tracks(folder):
    write(folder)
    (folder / "face.obj").write_bytes(b"")
    with pytest.raises(InputError) as raised:
        read_take(folder, TakeOptions(image_size=SIZE))
    assert raised.value.code == "FILE_KIND_UNKNOWN"
