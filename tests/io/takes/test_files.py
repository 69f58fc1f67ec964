import csv

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.takes.files import read_take
from usdface.options import TakeOptions
from usdface.takes import MarkerTake, WeightsTake

MARKERS = "time,A_x,A_y,A_z\n0,1,2,3\n0.1,1,2,3\n0.2,1,2,4\n"
LONG = "frame,marker,x,y\n1,A,1,2\n1,B,3,4\n2,A,1,2\n"
LIVE_LINK = (
    "Timecode,BlendShapeCount,JawOpen,HeadYaw\n"
    "00:00:01:58.000,61,0.5,0\n00:00:02:00.000,61,0.6,0\n00:00:02:02.000,61,0.7,0\n"
)
MOTIVE = (
    "Format Version,1.23,Export Frame Rate,100,Length Units,Meters\n\n"
    ",Type,Marker,Marker,Marker\n,Name,A,A,A\n,ID,1,1,1\n,,Position,Position,Position\n"
    "Frame,Time (Seconds),X,Y,Z\n0,0.00,1,2,3\n1,0.01,1,2,3\n"
)
VICON = "Trajectories\n100\n,,Face:A,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n1,0,1,2,3\n2,0,1,2,3\n"
QUALISYS = (
    "NO_OF_FRAMES\t2\nNO_OF_MARKERS\t1\nFREQUENCY\t100\nDATA_INCLUDED\t3D\nMARKER_NAMES\tA\n"
    "1\t2\t3\n1\t2\t3\n"
)
TRC = (
    "PathFileType\t4\t(X/Y/Z)\ta.trc\n"
    "DataRate\tNumFrames\tNumMarkers\tUnits\n60\t2\t1\tmm\n"
    "Frame#\tTime\tA\t\t\n\t\tX1\tY1\tZ1\n\n1\t0.00\t1\t2\t3\n2\t0.0167\t1\t2\t3\n"
)
BVH = (
    "HIERARCHY\nROOT A\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
    "End Site\n{\nOFFSET 0 1 0\n}\n}\nMOTION\nFrames: 2\nFrame Time: 0.04\n1 2 3\n1 2 4\n"
)


def c3d_bytes(tmp_path):
    import ezc3d

    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [60]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["A", "B"]
    file["data"]["points"] = np.ones((4, 2, 30))
    file.write(str(tmp_path / "made.c3d"))
    return (tmp_path / "made.c3d").read_bytes()


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        ("a.csv", MARKERS, MarkerTake),
        ("a.CSV", LONG, MarkerTake),
        ("a.csv", "\ufeff" + LIVE_LINK, WeightsTake),
        ("a.csv", MOTIVE, MarkerTake),
        ("a.csv", VICON, MarkerTake),
        ("a.txt", VICON.replace(",", "\t"), MarkerTake),
        ("a.tsv", QUALISYS, MarkerTake),
        ("a.csv", TRC.replace("\t", ","), MarkerTake),
        ("a.trc", TRC, MarkerTake),
        ("a.bvh", BVH, MarkerTake),
        ("a.tsv", MARKERS.replace(",", "\t"), MarkerTake),
    ],
)
def test_suffix_and_content_decide(tmp_path, name, text, kind):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    take, _ = read_take(path)
    assert isinstance(take, kind)
    assert take.source == name


OPENFACE = (
    "frame, face_id, timestamp, confidence, success, x_0, x_1, y_0, y_1\n"
    "1, 0, 0.000, 0.98, 1, 10, 20, 30, 40\n2, 0, 0.040, 0.98, 1, 11, 20, 30, 40\n"
)
SLEAP = "track,frame_idx,instance.score,A.x,A.y,A.score\n,0,0.9,10,20,0.9\n,1,0.9,11,20,0.9\n"


@pytest.mark.parametrize("text", [MARKERS, LONG, LIVE_LINK, MOTIVE, VICON, OPENFACE, SLEAP])
@pytest.mark.parametrize(
    ("delimiter", "quoting"),
    [
        (";", csv.QUOTE_MINIMAL),
        ("\t", csv.QUOTE_MINIMAL),
        (",", csv.QUOTE_ALL),
        (";", csv.QUOTE_ALL),
    ],
)
def test_a_table_that_a_spreadsheet_wrote_back_is_the_same(tmp_path, text, delimiter, quoting):
    path = tmp_path / "a.csv"
    path.write_text(text)
    before, found = read_take(path)
    with path.open("w", newline="", encoding="utf-8-sig") as file:
        writer = csv.writer(file, delimiter=delimiter, quoting=quoting)
        writer.writerows(csv.reader(text.splitlines()))
    after, again = read_take(path)
    assert [f.code for f in again] == [f.code for f in found]
    assert (after.names, after.rate) == (before.names, before.rate)
    values = "weights" if isinstance(before, WeightsTake) else "positions"
    np.testing.assert_array_equal(getattr(after, values), getattr(before, values))


def test_options_reach_every_marker_file(tmp_path):
    files = (("a.csv", MARKERS), ("b.csv", MOTIVE), ("c.csv", VICON), ("d.tsv", QUALISYS))
    for name, text in (*files, ("a.trc", TRC), ("a.bvh", BVH)):
        path = tmp_path / name
        path.write_text(text)
        take, _ = read_take(path, TakeOptions(dimension=2, rate=10))
        assert take.positions[0, 0].tolist() == [1, -2]
        assert take.rate == 10


@pytest.mark.parametrize(
    ("name", "text"), [("a.csv", MARKERS), ("a.csv", MOTIVE), ("a.csv", LIVE_LINK), ("a.trc", TRC)]
)
def test_a_start_timecode_is_that_of_any_take(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    take, findings = read_take(path, TakeOptions(start_timecode="01:02:03:04"))
    assert take.start_timecode == "01:02:03:04"
    assert "TIMECODE_ASSUMED" not in [f.code for f in findings]


@pytest.mark.parametrize(
    ("timecode", "rate", "fits"),
    [
        ("01:00:00:24", 24.0, False),
        ("01:00:00:23", 23.976, True),
        ("01:00:00;29", 29.97, True),
        ("01:00:00:30", 29.97, False),
        ("01:00:00:23.5", 24.0, True),
        ("01:00:00:29", 12.0, True),  # of the clock of another camera
        ("01:00:00:29", 120.0, True),
    ],
)
def test_the_frame_of_a_start_timecode_is_one_of_a_second(tmp_path, timecode, rate, fits):
    path = tmp_path / "a.csv"
    path.write_text("frame,name,x,y,z\n" + "".join(f"{n},nose,0,0,{n}\n" for n in range(3)))
    options = TakeOptions(start_timecode=timecode, rate=rate, units="mm")
    if fits:
        assert read_take(path, options)[0].start_timecode == timecode
    else:
        with pytest.raises(InputError, match=f"expected 0 to {round(rate) - 1}, of"):
            read_take(path, options)


@pytest.mark.parametrize(
    "text", ["01:02:03", "1 o'clock", "01:60:00:00", "01:00:00:0a", "24:00:00:00"]
)
def test_what_is_no_timecode_is_refused(text):
    with pytest.raises(InputError, match="expected HH:MM:SS:FF"):
        TakeOptions(start_timecode=text)


@pytest.mark.parametrize(
    ("step", "unusual"), [(0.001, True), (0.002, False), (0.125, False), (0.5, True)]
)
def test_a_rate_at_which_no_face_is_recorded_is_reported(tmp_path, step, unusual):
    path = tmp_path / "take.csv"
    rows = [f"{k * step:g},1,2,{k}" for k in range(4)]
    path.write_text("\n".join(["time,A_x,A_y,A_z", *rows]))
    take, findings = read_take(path, TakeOptions(units="mm"))
    assert take.rate == pytest.approx(1 / step)
    found = [each for each in findings if each.code == "RATE_UNUSUAL"]
    assert [each.values["rate_hz"] for each in found] == [pytest.approx(1 / step)] * unusual


def test_images_are_read_as_images(tmp_path):
    image = tmp_path / "face.0001.png"
    image.touch()
    for path in (tmp_path, image, tmp_path / "face.####.png"):
        with pytest.raises(InputError, match=r"0001\.png is not readable"):
            read_take(path)


def test_what_is_no_take_is_refused(tmp_path):
    (tmp_path / "a.fbx").touch()
    with pytest.raises(InputError, match=r"'\.fbx' are not read; expected C3D \(\.c3d\)") as caught:
        read_take(tmp_path / "a.fbx")
    # Not all 27 formats with 45 suffixes.
    told = " more (`usdface formats` lists them); export its markers as C3D, TRC or BVH"
    assert str(caught.value).endswith(told)
    with pytest.raises(InputError, match="no such file"):
        read_take(tmp_path / "a.c3d")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("suffix", "text"),
    [
        (".csv", MARKERS),
        (".csv", LONG),
        (".csv", LIVE_LINK),
        (".csv", MOTIVE),
        (".csv", VICON),
        (".tsv", QUALISYS),
        (".trc", TRC),
        (".bvh", BVH),
        (".c3d", None),
    ],
)
def test_damaged_files_give_a_take_or_one_line(tmp_path, suffix, text):
    """Cut, flipped and doubled bytes: nothing but InputError may come out."""
    whole = c3d_bytes(tmp_path) if text is None else text.encode()
    rng = np.random.default_rng(17)
    path = tmp_path / f"a{suffix}"
    refused = 0
    for round_ in range(150):
        data = bytearray(whole)
        if round_ % 3 == 0:
            data = data[: rng.integers(len(data))]
        else:
            head = min(len(data), 1500)
            for place in rng.integers(head, size=rng.integers(1, 6)):
                data[place] = (
                    rng.integers(256) if round_ % 3 == 1 else rng.choice(list(b"9e-,\n\t"))
                )
        path.write_bytes(data)
        try:
            read_take(path)
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)
            assert path.name in str(error)
    assert refused
