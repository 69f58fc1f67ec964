"""What is wrong with a file's blend shapes: `usdface check`."""

from pathlib import Path

from usdface.blas_threads import one_blas_thread
from usdface.findings import Finding
from usdface.io.check import check_file
from usdface.pipeline.schemas import register_schemas
from usdface.result import OnStep, Result, Steps

__all__ = ["check"]


@one_blas_thread()
def check(paths: list[Path], on_step: OnStep | None = None) -> Result:
    """Check blend shapes and their animation beyond what the standard validators look at."""
    register_schemas()
    steps = Steps(on_step)
    findings: list[Finding] = []
    for path in paths:
        with steps(f"check {path.name}"):
            findings += check_file(path)
    summary = {"files": len(paths), "findings": len(findings)}
    return Result((), tuple(findings), summary, steps.seconds)
