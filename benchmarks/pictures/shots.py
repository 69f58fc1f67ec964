"""Real takes on heads, retargeted through files as a user does it."""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import usdface
from usdface.shot.shot import ShotResult

__all__ = ["HEADS", "TAKES", "bind_file", "head_file", "played"]

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"
EXAMPLES = ROOT / "examples"
sys.path.insert(0, str(ROOT / "tests"))
from ict_face import write_meshes  # noqa: E402

HEADS = ("ict", "makehuman", "example")
# Marker takes need a bind file for each head, weights none; the example's take is bound to its own.
TAKES = {
    "jaw": DATA / "animface" / "Jaw.c3d",
    "eyebrows": DATA / "animface" / "Eyebrows.c3d",
    "live": DATA / "livelinkface" / "alex_rom_3.csv",
    "example": EXAMPLES / "performance.trc",
}


def played(
    takes: Sequence[str], heads: Sequence[str], folder: Path, *, proposed: bool
) -> Iterator[tuple[str, str, ShotResult]]:
    """Yield the name of each take, of the head, and the result; files go to `folder`.

    With `proposed` places are proposed, as for a new user, in place of those set by hand.
    """
    for head in heads:
        rig = None
        for take in takes:
            bind = None if proposed else bind_file(take, head)
            if bind and not bind.is_file():
                print(f"{take} on {head}, left out: no bind file")
                continue
            rig = rig or head_file(head, folder)
            place = folder / f"{take}_{head}"
            recorded, shot = place.with_suffix(".usdc"), place.with_suffix(".usda")
            usdface.make_take(TAKES[take], recorded)
            try:
                usdface.make_shot(rig, recorded, shot, bind=bind)
            except usdface.InputError as error:
                print(f"{take} on {head}, left out: {error}")
                continue
            yield take, head, usdface.process(shot).value


def bind_file(take: str, head: str) -> Path | None:
    """Return the places that were set by hand, a file that may be missing; weights need none."""
    if take == "live":
        return None
    if take == "example":
        return EXAMPLES / ("bind.json" if head == "example" else f"{head}_bind.json")
    return ROOT / "tests" / "data" / f"animface_{head}_bind.json"


def head_file(head: str, folder: Path) -> Path:
    """Write the rig of a head to a folder."""
    rig = folder / f"{head}.usdc"
    if head == "ict":
        meshes = folder / "ict"
        write_meshes(DATA, meshes)
        source = meshes
    else:
        source = DATA / "makehuman_cc0" if head == "makehuman" else EXAMPLES / "head.usdc"
    usdface.make_rig(source, rig)
    return rig
