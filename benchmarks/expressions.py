"""Outputs and corrections of the expression layer: `python benchmarks/expressions.py`.

Three faces, each with two or three layouts of markers; everything goes through the real solve with
0.3 mm of marker noise.
Tables: intensity sweep, specificity, under-expressive performers, contact and sides. See README.md.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path.insert(0, str(ROOT / "tests"))
from face_answers import (  # noqa: E402
    AMOUNTS,
    contact,
    loudest_alone,
    one_sided,
    others_heard,
    range_of_motion,
    sweep,
    weak_expressions,
)
from faces import FACES, Face, make_face  # noqa: E402

from usdface.io.expressions_file import read_expressions_file  # noqa: E402


def table(title: str, columns: str) -> Table:
    made = Table(title=title)
    for column in columns.split(","):
        made.add_column(column, justify="left" if column in ("face", "emotion") else "right")
    return made


def sweeps(faces: dict[str, Face]) -> Table:
    columns = "face,emotion,strongest from 15 % on,largest error,largest fall,neutral after"
    made = table("Each expression pose from 0 to 100 %", columns)
    for kind, face in faces.items():
        for emotion, heard in sweep(face).items():
            figures = (heard.error, heard.fall, heard.rest)
            cells = [f"{figure:.3f}" for figure in figures]
            made.add_row(kind, emotion, f"{100 * heard.right:.1f} %", *cells)
    return made


def beyond(kinds: Sequence[str]) -> Table:
    """Play contempt and Plutchik's two beside the six."""
    files = (
        ROOT / "examples" / "expressions" / f"{name}.json" for name in ("contempt", "plutchik")
    )
    given = {name: pose for file in files for name, pose in read_expressions_file(file).items()}
    columns = "face,emotion,strongest from 15 % on,largest error"
    made = table("Nine expressions: those beyond six, and the six where they change", columns)
    for kind in kinds:
        alone = sweep(make_face(kind, SHARED))
        for emotion, heard in sweep(make_face(kind, SHARED, given)).items():
            if emotion in given or abs(heard.error - alone[emotion].error) > 0.02:
                made.add_row(kind, emotion, f"{100 * heard.right:.1f} %", f"{heard.error:.3f}")
    return made


def specificity(faces: dict[str, Face]) -> tuple[Table, Table]:
    columns = (
        "face,jitter: mean,largest,shapes alone above 0.35,range of motion: above 0.5,moved by"
    )
    made = table("What is no emotion", columns)
    varied = table(
        "Another emotion in an expression with one more movement", "face,above 0.35,largest"
    )
    for kind, face in faces.items():
        jitter = face.play(np.zeros((3000, len(face.mesh.shapes)))).emotions
        alone = [
            f"{shape}: {emotion} {output:.2f}"
            for shape, heard in loudest_alone(face).items()
            for emotion, output in heard.items()
            if output > 0.35
        ]
        motion = ["", ""]
        if "makehuman" not in kind:  # the recorded curves are ARKit's
            played = face.play(*range_of_motion(face, SHARED))
            often = (played.emotions > 0.5).mean(axis=0)
            loudest = face.expressions[int(often.argmax())].name
            moved = np.abs(played.corrected - played.solved).mean()
            motion = [f"{loudest} in {100 * often.max():.1f} %", f"{moved:.4f}"]
        mean, largest = jitter.mean(axis=0).max(), jitter.max()
        other = others_heard(face)
        varied.add_row(kind, f"{100 * (other > 0.35).mean():.1f} %", f"{other.max():.2f}")
        listed = "\n".join(alone) or "none"
        made.add_row(kind, f"{mean:.4f}", f"{largest:.3f}", listed, *motion)
    return made, varied


def weak(faces: dict[str, Face]) -> tuple[Table, Table]:
    amounts = ",".join(f"at {100 * amount:.0f} %" for amount in AMOUNTS)
    title = "Distance to the whole expression, after the correction by before"
    shares = table(title, f"face,emotion,{amounts}")
    curves = table(
        "The correction itself", "face,neutral moves by,roughness by solve's,largest jump"
    )
    for kind, face in faces.items():
        corrected = weak_expressions(face)
        for emotion, parts in corrected.share.items():
            shares.add_row(kind, emotion, *(f"{part:.2f}" for part in parts))
        rough, jump = f"{corrected.roughness:.2f}", f"{corrected.jump:.3f}"
        curves.add_row(kind, f"{corrected.neutral:.4f}", rough, jump)
    return shares, curves


def touching(faces: dict[str, Face]) -> tuple[Table, Table]:
    columns = "face,lips part,kept,lids part,kept,lips cross,kept,lids cross,kept"
    made = table("Every expression over closed lips and lids: gaps change by [mm]", columns)
    halves = table("Half an expression", "face,its half moves by,the other,mirror image differs by")
    for kind, face in faces.items():
        found = contact(face)
        both = (found.opened, found.crossed)
        cells = [f"{gap:.2f}" for gaps in both for pair in gaps.values() for gap in pair]
        made.add_row(kind, *cells)
        sides = one_sided(face)
        halves.add_row(kind, f"{sides.own:.3f}", f"{sides.other:.3f}", f"{sides.mirror:.3f}")
    return made, halves


def design_figures() -> dict[str, float]:
    """Return what `benchmarks/sensitivity.py` judges rule design by: without noise and solve."""
    amounts, off, alone, varied = np.linspace(0, 1, 21), [], 0, []
    rules = 0
    for kind in FACES:
        face = make_face(kind, SHARED)
        poses = (amounts[:, None, None] * face.poses).reshape(-1, len(face.mesh.shapes))
        outputs = face.hear(poses)
        shown = (amounts[:, None, None] * np.eye(len(face.poses))).reshape(outputs.shape)
        off.append(np.abs(outputs - shown).max())
        alone += len(loudest_alone(face))
        varied.append((others_heard(face) > 0.35).mean())
        rules += sum(len(rule.propositions) for rule in face.system.fuzzy.rules)
    return {
        "conditions": float(rules),
        "largest error": float(max(off)),
        "blend shapes alone above 0.1": float(alone),
        "varied expressions above 0.35 %": 100.0 * float(np.mean(varied)),
    }


def layer_figures() -> dict[str, float]:
    """Return figures of the expression layer at work, with noise and solve, on the example face."""
    face = make_face("example", SHARED)
    sweeps_, weak_, held = sweep(face), weak_expressions(face), contact(face)
    return {
        "output error": max(each.error for each in sweeps_.values()),
        "output fall": max(each.fall for each in sweeps_.values()),
        "distance left": float(np.mean(list(weak_.share.values()))),
        "change at neutral": weak_.neutral,
        "roughness": weak_.roughness,
        "jump": weak_.jump,
        "lips opened mm": held.opened["lips"][1],
        "lids opened mm": held.opened["lids"][1],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faces", nargs="+", choices=FACES, default=FACES)
    kinds = parser.parse_args().faces
    faces = {kind: make_face(kind, SHARED) for kind in kinds}
    console = Console(width=None if sys.stdout.isatty() else 110)
    for made in (sweeps(faces), beyond(kinds), *specificity(faces), *weak(faces), *touching(faces)):
        console.print(made)


if __name__ == "__main__":
    main()
