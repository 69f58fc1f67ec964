"""Verdicts on good takes and on takes spoilt on purpose: `python -m benchmarks.verdict`.

The limits of `usdface.verdict.criteria` were set with the part "building"; the part "end" was
looked at once, after that. See docs/verdict.md.
"""

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

import usdface
from benchmarks.performers.worlds import BUILT_WITH, JUDGED_ON, ROWS, perform
from benchmarks.solve.faces import ROOT, has_real_data
from usdface.errors import UsdFaceError
from usdface.io.bind_file import read_bind
from usdface.io.rigs.files import read_rig_file
from usdface.io.takes.files import read_take
from usdface.options import ProcessOptions
from usdface.rigs import Mesh, Rig
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot.report import report_of
from usdface.shot.shot import Shot
from usdface.takes import MarkerTake

sys.path.insert(0, str(ROOT / "tests"))
from ict_face import ict_mesh

DATA = ROOT.parent / "shared" / "data"
FRAMES = 700
# The verdict that each way of spoiling a take must get at least.
SPOILT = {
    "as it is": "good",  # or "look at" where the character lacks shapes for the take
    "ten times as large": "look_at",
    "a tenth as large": "look_at",
    "mirrored labels": "not_usable",
    "mirrored take": "not_usable",
    "places in another order": "not_usable",
    "places of the neighbour": "not_usable",
    "four places exchanged": "not_usable",
    "places off by 20 mm": "look_at",
    "neutral at the peak": "look_at",
    "neutral at a third quartile": "look_at",
    "2 mm of noise": "look_at",
    "5 mm of noise": "look_at",
}
ORDER = ("good", "look_at", "not_usable")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.verdict")
    parser.add_argument("--part", choices=("building", "end"), default="building")
    parser.add_argument("--data", type=Path, default=DATA, metavar="DIR")
    parser.add_argument("--json", type=Path, metavar="FILE")
    parser.add_argument("--only", default="", help="takes whose name holds this")
    parsed = parser.parse_args()
    if not has_real_data(parsed.data):
        sys.exit(f"{parsed.data} has no range-of-motion curves and no ICT face")
    rows = []
    for name, shot in shots(parsed.data, parsed.part):
        if parsed.only not in name:
            continue
        for kind, spoilt in spoil(shot, np.random.default_rng(1)):
            rows.append({"take": name, "spoilt": kind, **judged(spoilt)})
            print(_line(rows[-1]), flush=True)
    wrong = [row for row in rows if not right(row)]
    good = [row["level"] for row in rows if row["spoilt"] == "as it is"]
    print(f"{len(rows) - len(wrong)} of {len(rows)} told apart; as they are:", end=" ")
    print(", ".join(f"{good.count(level)} {level}" for level in ORDER))
    if parsed.json:
        parsed.json.write_text(json.dumps(rows, indent=1))


def right(row: dict) -> bool:
    """Return whether a good take is usable, and a spoilt one as bad as it must be."""
    level, least = ORDER.index(row["level"]), ORDER.index(SPOILT[row["spoilt"]])
    return level < 2 if least == 0 else level >= least


def _line(row: dict) -> str:
    reasons = ", ".join(f"{reason['code']} {reason['value']:.2f}" for reason in row["reasons"])
    mark = "" if right(row) else "  <-- "
    return f"{row['take']:32}{row['spoilt']:28}{row['level']:12}{reasons}{mark}"


def judged(shot: Shot) -> dict:
    """Return the verdict on a shot as plain values; an error is not usable."""
    try:
        options = ProcessOptions(express=False, closure=False)
        report = report_of(usdface.retarget(shot, options=options))
    except UsdFaceError as error:
        refused = {"code": f"refused: {error}", "value": np.nan}
        return {"level": "not_usable", "reasons": [refused]}
    assert report.verdict is not None, report.findings
    return report.verdict.as_dict()


def shots(data: Path, part: str) -> Iterator[tuple[str, Shot]]:
    """Yield takes that are known to be good."""
    rig, _ = usdface.read_rig(ROOT / "examples" / "head.usdc")
    if part == "building":
        take, _ = usdface.read_take(ROOT / "examples" / "take.usdc")
        setup, _ = usdface.read_bind(ROOT / "examples" / "bind.json")
        yield "example", usdface.assemble_shot(rig, take, setup=setup)[0]
    ict = ict_mesh(data)
    heads = {"ict": ict, "makehuman": read_rig_file(data / "makehuman_cc0")[0].face()}
    take = read_take(data / "animface" / ("Jaw.c3d" if part == "building" else "Eyebrows.c3d"))[0]
    for head, mesh in {**heads, "example": rig.face()}.items():
        setup, _ = read_bind(ROOT / "tests" / "data" / f"animface_{head}_bind.json")
        yield f"{Path(take.source).stem} {head}", _cut(_shot(mesh, take, setup))
    for number in BUILT_WITH if part == "building" else JUDGED_ON:
        for row in (ROWS[0], ROWS[2]):
            played = perform(data, number, row, part=slice(0, FRAMES))
            positions = played.positions
            names = tuple(f"m{i:02d}" for i in range(positions.shape[1]))
            take = MarkerTake(names, np.arange(len(positions)) / 30, positions, 30.0)
            setup = RetargetSetup(
                Binding(names, played.bound, ict.name), neutral=(0, played.neutral_frames - 1)
            )
            yield f"performer {number}, {row.name}", _shot(ict, take, setup)


def _shot(mesh: Mesh, take: MarkerTake, setup: RetargetSetup) -> Shot:
    binding = replace(setup.binding, mesh=mesh.name)
    shot = Shot(Rig("face", (mesh,)), take, replace(setup, binding=binding))
    return usdface.assemble_shot(shot.rig, take, setup=shot.setup)[0]


def _cut(shot: Shot) -> Shot:
    """Return the first frames of a shot."""
    take = shot.take
    assert isinstance(take, MarkerTake)
    return replace(shot, take=take.with_frames(slice(0, FRAMES)))


def spoil(shot: Shot, rng: np.random.Generator) -> Iterator[tuple[str, Shot]]:
    """Yield the shot as it is, and spoilt in every way."""
    take, binding, points = shot.take, shot.setup.binding, shot.mesh.points
    assert isinstance(take, MarkerTake)
    vertices, count = binding.points, len(binding.points)
    nearest = cKDTree(points)

    def moved(positions: np.ndarray) -> Shot:
        return replace(shot, take=replace(take, positions=positions))

    def placed(points: np.ndarray) -> Shot:
        return replace(shot, setup=replace(shot.setup, binding=replace(binding, points=points)))

    def rested(frame: int) -> Shot:
        return replace(shot, setup=replace(shot.setup, neutral=(frame, frame)))

    yield "as it is", shot
    yield "ten times as large", moved(10.0 * take.positions)
    yield "a tenth as large", moved(0.1 * take.positions)
    yield "mirrored labels", placed(nearest.query(points[vertices] * [-1, 1, 1])[1])
    yield "mirrored take", moved(take.positions * [-1, 1, 1])
    yield "places in another order", placed(vertices[rng.permutation(count)])
    yield "places of the neighbour", placed(np.roll(vertices, 1))
    four = rng.choice(count, 4, replace=False)
    exchanged = vertices.copy()
    exchanged[four] = vertices[np.roll(four, 1)]
    yield "four places exchanged", placed(exchanged)
    away = rng.normal(size=(count, 3))
    away *= 0.02 / np.linalg.norm(away, axis=1, keepdims=True)
    yield "places off by 20 mm", placed(nearest.query(points[vertices] + away)[1])
    order = _order_of_motion(shot)
    yield "neutral at the peak", rested(order[-1])
    yield "neutral at a third quartile", rested(order[3 * len(order) // 4])
    for millimetres in (2, 5):
        noise = 0.001 * millimetres * rng.normal(size=take.positions.shape)
        yield f"{millimetres} mm of noise", moved(take.positions + noise)


def _order_of_motion(shot: Shot) -> list[int]:
    """Return the frame indices by how far the markers are from where they are in the neutral."""
    take, neutral = shot.take, shot.setup.neutral or (0, 0)
    bound = [take.names.index(name) for name in shot.setup.binding.markers if name in take.names]
    positions = take.positions[:, bound]
    centred = positions - np.nanmean(positions, axis=1, keepdims=True)
    rest = np.nanmean(centred[neutral[0] : neutral[1] + 1], axis=0)
    away = np.nanmean(np.linalg.norm(centred - rest, axis=2), axis=1)
    return np.argsort(away).tolist()


if __name__ == "__main__":
    main()
