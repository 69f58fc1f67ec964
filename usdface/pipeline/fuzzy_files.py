"""Fuzzy systems as files: `usdface fuzzy convert`, `usdface fuzzy paper`."""

from pathlib import Path

from usdface.correction.rule_check import check_rules
from usdface.expression_system import ExpressionSystem
from usdface.findings import Finding
from usdface.io.atomic import check_place
from usdface.io.fuzzy_formats.files import USD, read_fuzzy_file, write_fuzzy_file
from usdface.io.usd.stage import files_of, open_stage
from usdface.pipeline.schemas import register_schemas
from usdface.result import OnStep, Result, Steps
from usdface.rule_design.paper_system import paper_system

__all__ = ["convert_fuzzy", "write_paper"]


def convert_fuzzy(source: Path, output: Path, on_step: OnStep | None = None) -> Result:
    """Convert a fuzzy system between .fis, FCL, FLL and USD; say what is doubtful in it."""
    register_schemas()
    steps = Steps(on_step)
    check_place(output, source)
    with steps("read"):
        system, findings = read_fuzzy_file(source)
        if source.suffix.lower() in USD:
            check_place(output, *files_of(open_stage(source)))
    return _written(system, output, findings, steps)


def write_paper(output: Path, on_step: OnStep | None = None) -> Result:
    """Write the system of the fuzzy paper, as printed; say what is doubtful in it."""
    register_schemas()
    return _written(paper_system(), output, [], Steps(on_step))


def _written(
    system: ExpressionSystem, output: Path, findings: list[Finding], steps: Steps
) -> Result:
    findings = findings + check_rules(system)
    with steps("write"):
        findings += write_fuzzy_file(output, system)
    summary = {
        "inputs": len(system.fuzzy.inputs),
        "outputs": len(system.fuzzy.outputs),
        "terms": sum(len(v.terms) for v in system.fuzzy.variables),
        "rules": len(system.fuzzy.rules),
        "inference": system.fuzzy.inference,
    }
    return Result((output,), tuple(findings), summary, steps.seconds)
