"""A character and a take come together: `usdface shot`."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from usdface.binding.resolve_binding import bound_setup, proposal_summary
from usdface.correction.expression_layer import adopt, design, parts_of
from usdface.correction.rule_check import check_rules
from usdface.expression_system import ExpressionSystem
from usdface.face.expression_poses import expressions_for
from usdface.findings import Finding
from usdface.io.atomic import check_place
from usdface.io.bind_file import read_bind
from usdface.io.calibration_file import read_calibration_file
from usdface.io.expressions_file import read_expressions_file
from usdface.io.fuzzy_formats.files import read_fuzzy_file
from usdface.io.usd.rig import read_rig
from usdface.io.usd.shot import write_shot
from usdface.io.usd.stage import default_prim, open_stage
from usdface.io.usd.take import read_take_prim
from usdface.options import BindOptions, CorrectionOptions
from usdface.pipeline.schemas import register_schemas
from usdface.result import OnStep, Result, Steps
from usdface.retarget_setup import Expression, RetargetSetup, fit_setup
from usdface.rigs import Mesh

__all__ = ["make_shot"]


def make_shot(
    rig: Path,
    take: Path,
    bind: Path | None,
    output: Path,
    correction: Mapping[str, Any] | None = None,
    on_step: OnStep | None = None,
    fuzzy: Path | None = None,
    expressions_file: Path | None = None,
    binding: BindOptions = BindOptions(),
    calibration: Path | None = None,
) -> tuple[Result, RetargetSetup]:
    """Bring a rig and a take together, with expression poses and a fuzzy system for the rig.

    `bind` is the binding file; without one, places for the markers are proposed. `fuzzy` is a
    system to use in place of the default design. `correction` has those fields of
    `CorrectionOptions` that are told; the others are the system's own, or the defaults.
    `expressions_file` has poses that go before those of the dictionaries; `calibration` is what
    `calibrate` found of the performer. Returns the outcome and the setup as it was written
    (places, mesh and nose tip filled in).

    Raises
    ------
    InputError
        If the binding does not fit rig and take, or no places can be proposed.
    """
    register_schemas()
    steps = Steps(on_step)
    files = [path for path in (bind, fuzzy, expressions_file, calibration) if path]
    check_place(output, rig, take, *files)
    with steps("read"):
        character, findings = read_rig(rig)
        stage = open_stage(take)
        recorded, _ = read_take_prim(default_prim(stage, take))
        bound, notes = read_bind(bind) if bind else (None, [])
    with steps("bind"):
        mesh, named, more = bound_setup(character, recorded, bound, notes, binding)
        findings += more
        if calibration:
            named = replace(named, calibration=read_calibration_file(calibration))
        setup, more = fit_setup(named, mesh, recorded)
        findings += more
    with steps("design"):
        posed = read_expressions_file(expressions_file) if expressions_file else {}
        expressions, more = expressions_for(character.shape_names, posed)
        findings += more
        system, setup, more = _corrector(mesh, setup, expressions, fuzzy, correction or {})
        parts = parts_of(mesh, setup, expressions) if system else None
        findings += more
    with steps("write"):
        write_shot(output, rig, take, setup, system, expressions, parts)
    summary = {
        "markers bound": len(setup.binding.markers),
        **proposal_summary(setup),
        "blend shapes": len(character.shape_names),
        "expressions": ", ".join(e.name for e in expressions),
        "rules": len(system.fuzzy.rules) if system else 0,
    }
    return Result((output,), tuple(findings), summary, steps.seconds), setup


def _corrector(
    mesh: Mesh,
    setup: RetargetSetup,
    expressions: tuple[Expression, ...],
    fuzzy: Path | None,
    told: Mapping[str, Any],
) -> tuple[ExpressionSystem | None, RetargetSetup, list[Finding]]:
    """Return the fuzzy system of a file, or one designed for the rig, and the setup with it."""
    correction = CorrectionOptions(**told)  # what cannot be is refused
    if fuzzy is None:
        return design(mesh, setup, expressions, correction)
    system, findings = read_fuzzy_file(fuzzy)
    findings += check_rules(system)
    setup, more = adopt(system, setup, expressions, str(fuzzy))
    return replace(system, **told), setup, findings + more
