import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.takes.nuke import read_nuke
from usdface.options import TakeOptions

ROOT = 'Root {\n inputs 0\n fps 24\n format "2048 1556 0 0 2048 1556 1 2K"\n}\n'


@pytest.fixture
def read(tmp_path):
    def read(text, **options):
        path = tmp_path / "a.nk"
        path.write_text(text)
        return read_nuke(path, TakeOptions(**options))

    return read


def curve(x, y="x1 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0"):
    return f"Tracker3 {{\n track1 {{{{curve {x}}} {{curve {y}}}}}\n name T\n}}\n"


@pytest.mark.parametrize(
    ("words", "frames"),
    [
        ("x1 5 5 5", [1, 2, 3]),
        ("x1 5 5 x4 5 x5 5 5", [1, 2, 4, 5, 6]),
        ("x1 5 5 5 x6 5 5 5", [1, 2, 3, 6, 9, 12]),  # the step of the last two frames goes on
        ("x3 5 x6 5 x8 5 x9 5 5", [3, 6, 8, 9, 10]),
        ("K x1 5 s0.5 t0 u1 5 C", [1, 2]),
        ("i x5 5", [5]),
    ],
)
def test_a_value_without_a_frame_follows_by_the_last_step(read, words, frames):
    take, _ = read(ROOT + curve(words))
    np.testing.assert_allclose(take.times * 24 + frames[0], frames)
    np.testing.assert_allclose(take.positions[:, 0], [[5.0, -1556.0]] * len(frames))


def test_the_size_is_that_of_the_script_and_its_pixels_become_square(read):
    other = 'Read {\n format "100 100 0 0 100 100 1"\n}\n'
    take, _ = read(other + ROOT.replace("1556 1 2K", "1556 2 2K") + other + curve("x1 10 20"))
    assert take.image_size == (4096, 1556)
    assert take.positions[:, 0, 0].tolist() == [20, 40]


def test_a_size_that_is_given_is_stretched_as_the_places_are(read):
    root = ROOT.replace("1556 1 2K", "1556 2 2K")
    assert read(root + curve("x1 10 20"), image_size=(1024, 778))[0].image_size == (2048, 778)


def test_frames_in_which_only_one_coordinate_has_a_key_are_occluded(read):
    take, _ = read(ROOT + curve("x1 1 1 1", "x1 1 x3 1"))
    np.testing.assert_allclose(take.times * 24, [0, 2])


@pytest.mark.parametrize("first", [0, -5, 1001])
def test_frames_are_counted_from_the_first_of_the_script(read, first):
    root = ROOT.replace("inputs 0", f"first_frame {first}")
    take, findings = read(root + curve(f"x{first} 5 5", f"x{first} 0 0"))
    assert take.first_frame == 0
    assert "FRAMES_RENUMBERED" not in [each.code for each in findings]


def test_several_animated_points_of_a_node_are_numbered(read):
    knobs = " track1 {{curve x1 1 2} {curve x1 3 4}}\n track3 {{curve x1 5} {curve x1 6}}\n"
    node = f"Tracker3 {{\n{knobs}}}\n"
    assert read(ROOT + node)[0].names == ("Tracker track1", "Tracker track3")


def test_expressions_are_neither_evaluated_nor_read(read):
    columns = "{ 5 1 20 enable e 1 } { 3 1 75 name name 1 } "
    columns += "{ 2 1 58 x track_x 1 } { 2 1 58 y track_y 1 }"
    rows = '{ {} "a" {curve x1 1} {curve x1 2} } { {} "b" {"\\[python exit()]"} {curve x1 2} }'
    node = f"Tracker4 {{\n tracks {{ {{ 1 4 2 }} {{ {columns} }} {{ {rows} }} }}\n}}\n"
    take, findings = read(ROOT + node)
    assert take.names == ("a",)
    assert any("b" in f.message and "keys" in f.message for f in findings)


def test_the_word_curve_may_stand_in_quotes(read):
    take, _ = read(ROOT + curve("x1 1 2").replace("{curve ", '{"curve " '))
    np.testing.assert_allclose(take.positions[:, 0, 0], [1, 2])


def test_nodes_of_groups_are_read(read):
    take, _ = read(ROOT + "Group {\n name G\n}\n" + curve("x1 1") + "end_group\n")
    assert take.names == ("T",)


@pytest.mark.parametrize(
    "text",
    ["Tracker4 {\n}\n", "Tracker4 {\n tracks {{} {} {}}\n}\n", "Tracker3 {\n track1 {3 4}\n}\n"],
)
def test_a_script_without_animated_tracks_is_refused(read, text):
    with pytest.raises(InputError, match="no animated track"):
        read(text)
