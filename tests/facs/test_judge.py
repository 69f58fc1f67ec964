"""Verdicts on the shapes of three rigs: as they are, and with faults of known kinds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ict_face import ict_mesh
from spoilt_shapes import mirrored, mixed, renamed, silenced

from usdface.face.facing import turn_about_up
from usdface.facs.judge import judge_shapes
from usdface.facs.report import FacsReport, facs_findings, judge_rig
from usdface.geometry.bake_transform import bake_transform
from usdface.io.rigs.files import read_rig_file
from usdface.rigs import BlendShape, Rig


def wrong(report: FacsReport) -> dict[str, tuple[str, str]]:
    """Verdict and shown movement of each shape that is not as its name says."""
    return {
        v.name: (v.verdict, str(v.shown or ""))
        for v in report.shapes.verdicts
        if v.verdict not in ("done", "unnamed")
    }


def spoilt(rig: Rig, swapped: tuple[str, str], turned: str, dead: str) -> FacsReport:
    one, other = swapped
    rig = mirrored(silenced(rig, dead), turned)
    return judge_rig(renamed(rig, {one: other, other: one}), ())


def unnamed(report: FacsReport) -> set[str]:
    return {v.name for v in report.shapes.verdicts if v.verdict == "unnamed"}


@pytest.fixture(scope="module")
def makehuman(shared_data: Path) -> Rig:
    return read_rig_file(shared_data / "makehuman_cc0" / "targets")[0]


@pytest.fixture(scope="module")
def ict(shared_data: Path) -> Rig:
    return Rig("ict", (ict_mesh(shared_data),))


@pytest.mark.parametrize("degrees", [90.0, 180.0])
def test_a_face_that_looks_aside_is_judged_as_if_it_looked_ahead(
    head: Rig, judged_head: FacsReport, degrees: float
) -> None:
    turn = turn_about_up(degrees)
    aside = replace(head, meshes=tuple(bake_transform(mesh, turn) for mesh in head.meshes))
    assert wrong(judge_rig(aside, ())) == wrong(judged_head)


def test_every_shape_of_the_example_does_its_unit(judged_head: FacsReport) -> None:
    assert wrong(judged_head) == {}
    assert unnamed(judged_head) == {"tongueOut"}
    assert min(v.in_noise for v in judged_head.shapes.verdicts if v.claim) > 10
    assert not list(facs_findings(judged_head))


def test_every_shape_of_ict_does_its_unit(ict: Rig) -> None:
    report = judge_rig(ict, ())
    assert wrong(report) == {} and unnamed(report) == set()


@pytest.fixture(scope="module")
def whole_ict(ict: Rig, shared_data: Path) -> Rig:
    """ICT with the shapes that claim no unit: its eyeballs widen their pupils, and never turn."""
    packed = np.load(shared_data / "ict_facekit" / "ict_expressions.npz")
    more = tuple(
        BlendShape(name, packed[f"idx_{name}"], 0.01 * packed[f"off_{name}"].astype(np.float64))
        for name in ("PupilDilate_L", "PupilDilate_R", "cheekRaiser_L", "cheekRaiser_R")
    )
    return replace(ict, meshes=(replace(ict.meshes[0], shapes=(*ict.meshes[0].shapes, *more)),))


def test_wider_pupils_are_no_gaze(whole_ict: Rig) -> None:
    """The eyeballs, which no shape turns, do not count against the lids that follow the gaze."""
    report = judge_rig(whole_ict, ())
    assert wrong(report) == {}
    assert unnamed(report) == {"PupilDilate_L", "PupilDilate_R", "cheekRaiser_L", "cheekRaiser_R"}


@pytest.mark.parametrize(
    ("one", "other"),
    [("eyeLookDown_L", "eyeBlink_L"), ("eyeLookUp_R", "eyeWide_R"), ("eyeLookIn_L", "eyeLookUp_L")],
)
def test_a_gaze_under_another_name_is_found(whole_ict: Rig, one: str, other: str) -> None:
    report = judge_rig(renamed(whole_ict, {one: other, other: one}), ())
    found = {name: verdict for name, (verdict, _) in wrong(report).items()}
    assert found == {one: "swapped", other: "swapped"}


def test_every_shape_of_makehuman_does_its_unit(makehuman: Rig) -> None:
    report = judge_rig(makehuman, ())
    assert wrong(report) == {}
    assert unnamed(report) == {"mouth-compression", "mouth-upward-retraction", "nose-depression"}


def test_faults_of_the_example_are_named_and_nothing_else(head: Rig) -> None:
    swap = ("browDownLeft", "mouthFunnel")
    assert wrong(spoilt(head, swap, "mouthSmileRight", "eyeBlinkLeft")) == {
        "browDownLeft": ("swapped", "AU22"),
        "mouthFunnel": ("swapped", "AU4L"),
        "mouthSmileRight": ("other_side", "AU12L"),
        "eyeBlinkLeft": ("dead", ""),
    }


@pytest.mark.slow
def test_faults_of_ict_are_named_and_nothing_else(ict: Rig) -> None:
    swap = ("mouthFrown_L", "mouthStretch_L")
    assert wrong(spoilt(ict, swap, "noseSneer_R", "jawForward")) == {
        "mouthFrown_L": ("swapped", "AU20L"),
        "mouthStretch_L": ("swapped", "AU15L"),
        "noseSneer_R": ("other_side", "AU9L"),
        "jawForward": ("dead", ""),
    }


def test_faults_of_makehuman_are_named_and_nothing_else(makehuman: Rig) -> None:
    swap = ("mouth-pursing", "eye-right-slit")
    found = wrong(spoilt(makehuman, swap, "eyebrows-left-inner-up", "mouth-corner-puller"))
    assert found == {
        "mouth-pursing": ("swapped", "AU7R"),
        "eye-right-slit": ("swapped", "AU18"),
        "eyebrows-left-inner-up": ("other_side", "AU1R"),
        "mouth-corner-puller": ("dead", ""),
    }


def test_left_and_right_swapped(head: Rig) -> None:
    names = {"mouthSmileLeft": "mouthSmileRight", "mouthSmileRight": "mouthSmileLeft"}
    report = judge_rig(renamed(head, names), ())
    assert wrong(report) == {
        "mouthSmileLeft": ("swapped", "AU12R"),
        "mouthSmileRight": ("swapped", "AU12L"),
    }
    codes = {(f.code, f.where) for f in facs_findings(report)}
    assert codes == {("FACS_SHAPES_SWAPPED", name) for name in names}


@pytest.mark.slow
def test_a_direction_that_is_turned(head: Rig) -> None:
    assert wrong(judge_rig(mirrored(head, "jawLeft"), ())) == {"jawLeft": ("other_side", "AU30R")}


def test_a_shape_under_a_name_of_another_unit(head: Rig) -> None:
    """The true shape of the name is gone, so that nothing is swapped."""
    kept = judge_rig(renamed(head, {"mouthPucker": "cheekPuff", "cheekPuff": "horns"}), ())
    assert wrong(kept) == {"cheekPuff": ("other_unit", "AU18")}
    assert unnamed(kept) == {"tongueOut", "horns"}
    (found,) = facs_findings(kept)
    assert found.code == "FACS_UNIT_OTHER" and "AU18 lip pucker" in found.message


@pytest.mark.slow
def test_two_movements_in_one_shape(head: Rig) -> None:
    report = judge_rig(mixed(head, "eyeBlinkLeft", "mouthFrownRight"), ())
    assert wrong(report) == {"eyeBlinkLeft": ("mixed", "AU43L")}
    (found,) = facs_findings(report)
    assert found.code == "FACS_UNITS_MIXED"
    assert found.values["second"] == "AU15R lip corner depressor, right"


@pytest.mark.slow
def test_a_shape_that_moves_what_no_unit_moves(head: Rig) -> None:
    names, points = head.shape_names, judge_rig(head, ()).points
    moved = np.array(points.moved(head, names))
    row = names.index("mouthSmileLeft")
    moved[row] = np.random.default_rng(11).normal(0.0, 2.0, moved[row].shape)
    verdict = judge_shapes(names, moved, np.full(len(names), 9.0), 0.3).verdicts[row]
    assert verdict.verdict == "not_done"


def test_all_names_unknown(head: Rig) -> None:
    report = judge_rig(renamed(head, {n: f"shape{i}x" for i, n in enumerate(head.shape_names)}), ())
    assert {v.verdict for v in report.shapes.verdicts} == {"unnamed"}
    shown = {str(v.shown) for v in report.shapes.verdicts}
    assert {"AU12L", "AU43R", "AU26"} <= shown
