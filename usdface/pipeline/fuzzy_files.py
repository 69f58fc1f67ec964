"""Fuzzy systems as files: `usdface fuzzy convert`, `usdface fuzzy paper`."""

from pathlib import Path

from usdface.blas_threads import one_blas_thread
from usdface.findings import Finding
from usdface.fuzzy.lint import rule_findings
from usdface.fuzzy.system import FuzzySystem
from usdface.io.atomic import StrPath
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file
from usdface.io.inputs import check_outputs, files_read
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.rule_design.paper_system import paper_system

__all__ = ["convert_fuzzy", "write_paper_system"]


@one_blas_thread()
def convert_fuzzy(
    source: StrPath, output: StrPath, *, on_progress: OnProgress | None = None
) -> Result[FuzzySystem]:
    """Convert a fuzzy system between .fis, FCL, FLL and USD, and check its rule base.

    Parameters
    ----------
    source, output : path
        .fis, .fcl, .fll, .usda or .usdc.
    on_progress : callable, optional

    Returns
    -------
    Result of FuzzySystem
        Keys of the summary: ``inputs``, ``outputs``, ``terms``, ``rules``, ``inference``.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is written.

    Examples
    --------
    >>> usdface.convert_fuzzy("examples/shot.usda", "face.fis").summary["inference"]
    'sugeno'
    """
    source, output = Path(source), Path(output)
    register_schemas()
    progress = Progress.of(on_progress)
    check_outputs([output], files_read(source))
    with progress.step("read"):
        system, findings = read_fuzzy_file(source)
    return _written(system, output, findings, progress)


@one_blas_thread()
def write_paper_system(
    output: StrPath, *, on_progress: OnProgress | None = None
) -> Result[FuzzySystem]:
    """Write the system of the fuzzy paper, as printed, and check its rule base.

    Parameters, result and errors are those of `convert_fuzzy`.

    Examples
    --------
    >>> usdface.write_paper_system("paper.fis").summary["rules"]
    12
    """
    register_schemas()
    check_outputs([Path(output)], {})
    return _written(paper_system(), Path(output), [], Progress.of(on_progress))


def _written(
    system: FuzzySystem, output: Path, findings: list[Finding], progress: Progress
) -> Result[FuzzySystem]:
    findings = findings + rule_findings(system)
    with progress.step("write"):
        findings += write_fuzzy_file(output, system)
    summary = {
        "inputs": len(system.inputs),
        "outputs": len(system.outputs),
        "terms": sum(len(v.terms) for v in system.variables),
        "rules": len(system.rules),
        "inference": system.inference,
    }
    return Result(system, (output,), tuple(findings), summary, seconds=progress.seconds)
