"""Fuzzy systems as files: `usdface fuzzy convert`, `usdface fuzzy paper`."""

from pathlib import Path

from usdface.blas_threads import one_blas_thread
from usdface.findings import Finding
from usdface.fuzzy.lint import rule_findings
from usdface.fuzzy.system import FuzzySystem
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file
from usdface.io.inputs import check_outputs, files_read
from usdface.pipeline.schemas import register_schemas
from usdface.result import OnStep, Result, Steps
from usdface.rule_design.paper_system import paper_system

__all__ = ["convert_fuzzy", "write_paper"]


@one_blas_thread()
def convert_fuzzy(source: Path, output: Path, on_step: OnStep | None = None) -> Result:
    """Convert a fuzzy system between .fis, FCL, FLL and USD; say what is doubtful in it."""
    register_schemas()
    steps = Steps(on_step)
    check_outputs([output], files_read(source))
    with steps("read"):
        system, findings = read_fuzzy_file(source)
    return _written(system, output, findings, steps)


@one_blas_thread()
def write_paper(output: Path, on_step: OnStep | None = None) -> Result:
    """Write the system of the fuzzy paper, as printed; say what is doubtful in it."""
    register_schemas()
    check_outputs([output], {})
    return _written(paper_system(), output, [], Steps(on_step))


def _written(system: FuzzySystem, output: Path, findings: list[Finding], steps: Steps) -> Result:
    findings = findings + rule_findings(system)
    with steps("write"):
        findings += write_fuzzy_file(output, system)
    summary = {
        "inputs": len(system.inputs),
        "outputs": len(system.outputs),
        "terms": sum(len(v.terms) for v in system.variables),
        "rules": len(system.rules),
        "inference": system.inference,
    }
    return Result((output,), tuple(findings), summary, steps.seconds)
