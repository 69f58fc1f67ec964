import numpy as np
from track_writers import SIZE

from usdface.io.takes.pftrack import read_pftrack
from usdface.options import TakeOptions

STEREO = """# "name"

"left brow"
"Primary"
2
0 10.000 20.000 0.000
1 11.000 20.000 0.000 35.5
"Secondary"
1
0 500.000 20.000 0.000

"chin"
"Primary"
0
"Secondary"
1
1 510.000 20.000 0.000
"""


def test_of_two_cameras_the_first_is_read_and_the_other_is_told(tmp_path):
    path = tmp_path / "a.2dt"
    path.write_text(STEREO)
    take, findings = read_pftrack(path, TakeOptions(rate=25.0, image_size=SIZE))
    assert take.names == ("left brow",)
    np.testing.assert_allclose(take.positions[:, 0], [[10.5, 20.5 - 1080], [11.5, 20.5 - 1080]])
    assert any("Secondary" in f.message for f in findings if f.code == "CHANNEL_IGNORED")


def test_a_second_clip_stands_below_the_first(tmp_path):
    path = tmp_path / "a.2dt"
    path.write_text('"a"\n1\n1\n1 1 1 0\n2\n1\n1 9 9 0\n"b"\n1\n1\n1 2 2 0\n2\n0\n')
    take, _ = read_pftrack(path, TakeOptions(rate=25.0, image_size=SIZE))
    assert take.names == ("a", "b")
    np.testing.assert_allclose(take.positions[0, :, 0], [1.5, 2.5])
