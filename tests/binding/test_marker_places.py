import json
from pathlib import Path

import numpy as np
import pytest
from worlds import make_world

from usdface.binding.marker_places import marker_places
from usdface.cli import main
from usdface.errors import InputError
from usdface.setup import Binding

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
NONE = Binding((), np.zeros(0, int))


def test_the_first_markers_go_where_shapes_move_most_and_leave_less_and_less_unseen() -> None:
    found = marker_places(MESH, NONE, 20, 3e-4)
    moved = np.linalg.norm(MESH.offsets_at(found.vertices), axis=2).max(axis=0)
    assert (moved > 0).all() and len(set(found.vertices.tolist())) == 20
    left = [len(found.unseen_before), *(len(rest) for rest in found.unseen)]
    assert left[0] == len(MESH.shape_names) and left == sorted(left, reverse=True)
    assert left[-1] == 0


def test_a_marker_that_is_missing_is_asked_for() -> None:
    kept = {name: v for name, v in WORLD.points.items() if not name.startswith("lid")}
    present = Binding(tuple(kept), np.array(list(kept.values())))
    found = marker_places(MESH, present, 2, 3e-4)
    assert {"eyeBlinkLeft", "eyeBlinkRight"} <= set(found.unseen_before)
    assert {"left eye", "right eye"} == {where.split(",")[0] for where in found.where}
    assert not {"eyeBlinkLeft", "eyeBlinkRight"} & set(found.unseen[-1])
    extended = found.binding(present)
    assert extended.markers[: len(kept)] == tuple(kept)
    assert set(extended.markers[len(kept) :]) == {"left_eye_1", "right_eye_1"}


@pytest.mark.parametrize("count", [0, -3, 10**6])
def test_a_number_of_markers_that_cannot_be(count: int) -> None:
    with pytest.raises(InputError, match="expected 1 to"):
        marker_places(MESH, NONE, count, 3e-4)


def test_the_command_writes_a_binding_and_draws_it(tmp_path: Path) -> None:
    folder = WORLD.write(tmp_path)
    rig, bind = str(folder / "rig.usda"), str(folder / "bind.json")
    more, picture = tmp_path / "more.json", tmp_path / "more.png"
    wanted = ["markers", rig, "--bind", bind, "-n", "3", "-o", str(more), "--figure", str(picture)]
    assert main(wanted) == 0
    before, after = (json.loads(Path(p).read_text())["markers"] for p in (bind, more))
    assert len(after) == len(before) + 3
    assert all(after[name]["point"] == before[name]["point"] for name in before)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["markers", rig, "-n", "0"]) == 1
