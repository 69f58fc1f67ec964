"""A recorded take becomes USD: `usdface take`."""

from pathlib import Path
from typing import Any

from usdface.blas_threads import one_blas_thread
from usdface.io.inputs import check_outputs, files_read
from usdface.io.takes.files import read_take
from usdface.io.usd.take import write_take
from usdface.options import TakeOptions
from usdface.result import OnStep, Result, Steps
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["make_take"]


@one_blas_thread()
def make_take(
    source: Path, output: Path, options: TakeOptions = TakeOptions(), on_step: OnStep | None = None
) -> Result:
    """Convert a take to USD: C3D, TRC, CSV, BVH or Live Link Face."""
    steps = Steps(on_step)
    check_outputs([output], files_read(source))
    with steps("read"):
        take, findings = read_take(source, options)
    with steps("write"):
        write_take(take, output)
    return Result((output,), tuple(findings), _summary(take), steps.seconds)


def _summary(take: MarkerTake | WeightsTake) -> dict[str, Any]:
    summary: dict[str, Any] = {
        "frames": len(take.times),
        "seconds": round(float(take.times[-1]), 3),
        "rate Hz": round(take.rate, 3),
    }
    if isinstance(take, MarkerTake):
        hidden = 1.0 - float(take.visible.mean())
        return summary | {
            "markers": len(take.names),
            "dimension": take.dimension,
            "occluded %": round(100 * hidden, 2),
        }
    return summary | {"blend shapes": len(take.names)}
