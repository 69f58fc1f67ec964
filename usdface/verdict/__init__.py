"""The verdict on a retargeted shot: good, look at, or not usable, and the reasons."""

from usdface.verdict.criteria import CRITERIA, Criterion
from usdface.verdict.judge import Level, Measured, Reason, Verdict, judge

__all__ = ["CRITERIA", "Criterion", "Level", "Measured", "Reason", "Verdict", "judge"]
