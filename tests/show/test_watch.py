"""Watching: a change of any file of a sequence ends the wait."""

import threading
from pathlib import Path

import pytest

from usdface.show import watch
from usdface.show.plan import Making, ShotPlan
from usdface.show.record import record_of, record_path, write_record


def plan_in(folder: Path) -> ShotPlan:
    making = Making(rig=folder / "rig.usda", take=folder / "take.usda")
    return ShotPlan(name="a", file=folder / "a.usda", making=making)


def test_files_below_a_shot_are_known_from_its_record(tmp_path: Path) -> None:
    for name in ("a.usda", "below.usda"):
        (tmp_path / name).touch()
    plan = plan_in(tmp_path)
    named = watch.files_of([tmp_path / "show.toml"], [plan])
    assert [file.name for file in named] == ["show.toml", "a.usda", "rig.usda", "take.usda"]
    read, absent = [tmp_path / "a.usda", tmp_path / "below.usda"], [tmp_path / "none.usda"]
    record = record_of(tmp_path, read=read, absent=absent, options={})
    write_record(record_path(plan.file), record)
    named = watch.files_of([tmp_path / "show.toml"], [plan])
    assert {"below.usda", "none.usda"} < {file.name for file in named}


@pytest.mark.parametrize("name", ["there", "new"])
def test_a_change_ends_the_wait(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setattr(watch, "_PAUSE", 0.01)
    (tmp_path / "there").write_text("a")
    looked = threading.Event()

    def files() -> list[Path]:
        looked.set()
        return [tmp_path / "there", tmp_path / "new"]

    waiting = threading.Thread(target=watch.wait_for_change, args=(files, {}), daemon=True)
    waiting.start()
    assert looked.wait(10)
    waiting.join(0.1)
    assert waiting.is_alive()
    (tmp_path / name).write_text("more")
    waiting.join(10)
    assert not waiting.is_alive()
