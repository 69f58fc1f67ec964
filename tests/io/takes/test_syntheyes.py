import pytest
from track_writers import SIZE

from usdface.errors import InputError
from usdface.io.takes.syntheyes import read_syntheyes
from usdface.options import TakeOptions


def test_the_outcome_says_where_a_tracker_is_seen(tmp_path):
    path = tmp_path / "a.txt"
    codes = {0: 15, 1: 7, 2: 5, 3: 3, 4: 39, 5: 31}
    path.write_text("".join(f"my dot {f} 0.1 0.2 {code}\n" for f, code in codes.items()))
    take, _ = read_syntheyes(path, TakeOptions(rate=25.0, image_size=SIZE))
    assert take.names == ("my dot",)
    assert take.visible[:, 0].tolist() == [True, True, False, False, False, True]


def test_other_scales_than_the_programs_own_are_refused(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("dot 0 960.5 200.1 15\n")
    with pytest.raises(InputError, match=r"reach 960\.5; expected parts of the image as SynthEyes"):
        read_syntheyes(path, TakeOptions(image_size=SIZE))
