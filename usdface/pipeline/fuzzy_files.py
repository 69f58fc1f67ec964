"""Fuzzy systems from file format to file format: `usdface fuzzy convert`."""

from pathlib import Path

from usdface.fuzzy.doubts import rule_findings
from usdface.io.atomic import check_place
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file
from usdface.outcome import OnStep, Outcome, Steps
from usdface.pipeline.schemas import register_schemas

__all__ = ["convert_fuzzy"]


def convert_fuzzy(source: Path, output: Path, on_step: OnStep | None = None) -> Outcome:
    """Convert a fuzzy system between .fis, FCL, FLL and USD; say what is doubtful in it."""
    register_schemas()
    steps = Steps(on_step)
    check_place(output, source)
    with steps("read"):
        system, findings = read_fuzzy_file(source)
        findings += rule_findings(system)
    with steps("write"):
        findings += write_fuzzy_file(output, system)
    summary = {
        "inputs": len(system.inputs),
        "outputs": len(system.outputs),
        "terms": sum(len(v.terms) for v in system.variables),
        "rules": len(system.rules),
        "inference": system.inference,
    }
    return Outcome((output,), tuple(findings), summary, steps.seconds)
