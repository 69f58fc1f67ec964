import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from processed import Done
from worlds import make_world, write_live_link

from usdface.cli import main
from usdface.errors import InputError
from usdface.io.usd.take_write import write_take
from usdface.pipeline import make_bind_page


def data_of(page: Path) -> dict[str, Any]:
    found = re.search(r'id="data">(.*?)</script>', page.read_text(encoding="utf-8"))
    assert found
    return json.loads(found[1])


@pytest.mark.slow
def test_rig_and_take_are_proposed_for(done: Done, tmp_path: Path) -> None:
    page, take = tmp_path / "bind.html", done.folder / "take.usda"
    result = make_bind_page(done.folder / "rig.usda", page, take=take)
    assert result.summary["markers"] == len(done.world.take.names)
    rows = data_of(page)["markers"]
    assert all(row["point"] >= 0 and row["confidence"] is not None for row in rows)


def test_a_shot_shows_its_own_binding(done: Done, tmp_path: Path) -> None:
    make_bind_page(done.folder / "shot.usda", tmp_path / "bind.html")
    data = data_of(tmp_path / "bind.html")
    assert {row["name"]: row["point"] for row in data["markers"]} == done.world.points
    assert data["document"]["mesh"] == "head", "a path would be that of the shot, not of its rig"
    assert data["nose_tip"] == "nose" and data["neutral"] == [0, data["document"]["neutral"]["end"]]


def test_a_binding_that_was_written_for_the_rig_begins_the_page_of_its_shot(
    done: Done, tmp_path: Path
) -> None:
    """Its mesh is a path of the rig, which has another in the shot."""
    bind = json.loads((done.folder / "bind.json").read_text())
    bind["markers"]["chin"] = {"point": 3}
    (tmp_path / "made.json").write_text(json.dumps(bind | {"mesh": "/Asset/Face/head"}))
    make_bind_page(done.folder / "shot.usda", tmp_path / "a.html", bind=tmp_path / "made.json")
    data = data_of(tmp_path / "a.html")
    assert {row["name"]: row["point"] for row in data["markers"]}["chin"] == 3
    assert data["document"]["mesh"] == "head"


def test_a_take_that_nothing_can_be_proposed_for_is_placed_by_hand(tmp_path: Path) -> None:
    world = make_world(head_moves=False)
    still = np.repeat(world.take.positions[:1], len(world.take.times), axis=0)
    folder = world.write(tmp_path)
    write_take(replace(world.take, positions=still), folder / "still.usda")
    result = make_bind_page(folder / "rig.usda", tmp_path / "a.html", take=folder / "still.usda")
    assert [f.code for f in result.findings] == ["PLACES_NOT_PROPOSED"]
    assert {row["state"] for row in data_of(tmp_path / "a.html")["markers"]} == {"out"}


def test_markers_are_needed(done: Done, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--take take\.usdc"):
        make_bind_page(done.folder / "rig.usda", tmp_path / "a.html")
    write_live_link(done.world, tmp_path / "live.csv")
    assert main(["take", str(tmp_path / "live.csv"), "-o", str(tmp_path / "live.usdc")]) == 0
    with pytest.raises(InputError, match="no markers to place"):
        make_bind_page(done.folder / "rig.usda", tmp_path / "a.html", take=tmp_path / "live.usdc")


@pytest.mark.parametrize("state", ["markers", "unsure"])
def test_a_binding_to_vertices_of_another_mesh_is_refused(
    done: Done, tmp_path: Path, state: str
) -> None:
    folder = done.folder
    bind = {"unsure": {}} | json.loads((folder / "bind.json").read_text())
    del bind["markers"]["chin"]
    bind[state]["chin"] = {"point": 10**5}
    (tmp_path / "other.json").write_text(json.dumps(bind))
    with pytest.raises(InputError, match="'chin' is bound to vertex 100000 of /Asset/Face/head"):
        make_bind_page(
            folder / "rig.usda",
            tmp_path / "a.html",
            take=folder / "take.usda",
            bind=tmp_path / "other.json",
        )
    assert not (tmp_path / "a.html").exists()
