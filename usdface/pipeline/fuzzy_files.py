"""Fuzzy systems as files: `usdface fuzzy convert`, `usdface fuzzy paper`."""

from pathlib import Path

from usdface.arguments import checked
from usdface.blas_threads import one_blas_thread
from usdface.correction.rule_check import check_rules
from usdface.expression_system import ExpressionSystem
from usdface.findings import Finding
from usdface.io.atomic import StrPath
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file
from usdface.io.inputs import check_outputs, files_read
from usdface.io.overwrite_protection import check_replaced
from usdface.pipeline.schemas import register_schemas
from usdface.progress import OnProgress, Progress
from usdface.result import Result
from usdface.rule_design.paper_system import paper_system

__all__ = ["convert_fuzzy", "write_paper_system"]


@checked
@one_blas_thread()
def convert_fuzzy(
    source: StrPath,
    output: StrPath,
    *,
    overwrite: bool = False,
    on_progress: OnProgress | None = None,
) -> Result[ExpressionSystem]:
    """Convert a fuzzy system between .fis, FCL, FLL and USD, and check its rule base.

    Parameters
    ----------
    source, output : path
        .fis, .fcl, .fll, .usda or .usdc.
    overwrite : bool
        Replace a USD file `output` also where it is no fuzzy system that usdface wrote.
    on_progress : callable, optional

    Returns
    -------
    Result of ExpressionSystem
        Keys of the summary: ``inputs``, ``outputs``, ``terms``, ``rules``, ``inference``.

    Raises
    ------
    UsdFaceError
        One clear line; nothing is written.

    Examples
    --------
    >>> usdface.convert_fuzzy("examples/shot.usda", "face.usda").summary["inference"]
    'sugeno'
    """
    source, output = Path(source), Path(output)
    register_schemas()
    progress = Progress.of(on_progress)
    check_outputs([output], files_read(source))
    check_replaced([(output, "fuzzy system")], overwrite)
    with progress.step("read"):
        system, findings = read_fuzzy_file(source)
    return _written(system, output, findings, progress)


@checked
@one_blas_thread()
def write_paper_system(
    output: StrPath, *, overwrite: bool = False, on_progress: OnProgress | None = None
) -> Result[ExpressionSystem]:
    """Write the system of the fuzzy paper, as printed, and check its rule base.

    Parameters
    ----------
    output : path
        .fis, .fcl, .fll, .usda or .usdc.
    overwrite : bool
        Replace a USD file `output` also where it is no fuzzy system that usdface wrote.
    on_progress : callable, optional

    Returns
    -------
    Result of ExpressionSystem
        Keys of the summary as those of `convert_fuzzy`.

    Raises
    ------
    OutputError
        If the file cannot be written, or is USD of another origin and `overwrite` is not set.

    Examples
    --------
    >>> usdface.write_paper_system("paper.fis").summary["rules"]
    12
    """
    output = Path(output)
    register_schemas()
    check_outputs([output], {})
    check_replaced([(output, "fuzzy system")], overwrite)
    return _written(paper_system(), output, [], Progress.of(on_progress))


def _written(
    system: ExpressionSystem, output: Path, findings: list[Finding], progress: Progress
) -> Result[ExpressionSystem]:
    findings = findings + check_rules(system)
    with progress.step("write"):
        findings += write_fuzzy_file(output, system)
    summary = {
        "inputs": len(system.fuzzy.inputs),
        "outputs": len(system.fuzzy.outputs),
        "terms": sum(len(v.terms) for v in system.fuzzy.variables),
        "rules": len(system.fuzzy.rules),
        "inference": system.fuzzy.inference,
    }
    return Result(system, (output,), tuple(findings), summary, seconds=progress.seconds)
