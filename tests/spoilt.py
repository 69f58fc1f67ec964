"""A folder of good files for a case of bad input to spoil."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf, Usd
from worlds import World

__all__ = ["Place", "Refused", "listing", "marker_take", "wide_csv"]


@dataclass(frozen=True)
class Place:
    """A folder with rig, take, binding and shot, all good until a case spoils one."""

    folder: Path
    world: World

    def __truediv__(self, name: str) -> Path:
        return self.folder / name

    def edit(self, name: str, change: Callable[[Usd.Stage], object]) -> None:
        """Change a stage and save it."""
        stage = Usd.Stage.Open(str(self / name))
        change(stage)
        stage.Save()

    def replace(self, name: str, old: str, new: str) -> None:
        """Change the text of a file."""
        text = (self / name).read_text()
        assert old in text
        (self / name).write_text(text.replace(old, new, 1))

    def bind(self, **changes: object) -> None:
        (self / "bind.json").write_text(json.dumps(self.world.bind | changes))

    @property
    def shot(self) -> list[object]:
        """The command that makes the shot anew."""
        named = ("rig", "take", "bind")
        files = [(f"--{n}", self / f"{n}.{'json' if n == 'bind' else 'usda'}") for n in named]
        return ["shot", *(x for pair in files for x in pair), "-o", self / "new.usda"]

    @property
    def process(self) -> list[object]:
        return ["process", self / "shot.usda"]


def listing(folder: Path) -> dict[str, str]:
    """Every file and folder below, with its content."""
    return {
        str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
        if p.is_file()
        else "folder"
        for p in folder.rglob("*")
    }


Refused = Callable[[Sequence[object]], str]


def wide_csv(place: Place, rows: Sequence[str], names: Sequence[str] = ("a", "b")) -> Path:
    header = ",".join(["time", *(f"{n}_{axis}" for n in names for axis in "xyz")])
    (place / "take.csv").write_text("\n".join([header, *rows]) + "\n")
    return place / "take.csv"


def marker_take(place: Place, name: str, value: object, code: float | None = None) -> None:
    attribute = Sdf.Path("/Take").AppendProperty(name)

    def change(stage: Usd.Stage) -> None:
        found = stage.GetAttributeAtPath(attribute)
        found.Set(value) if code is None else found.Set(value, code)

    place.edit("take.usda", change)
