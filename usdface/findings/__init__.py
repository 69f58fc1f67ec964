"""Findings: losses, guesses, approximations and faults, each with a stable code.

An error stops the run (`usdface.errors`); a finding lets it go on and is shown on screen
and in the report. The codes are in `usdface.findings.codes`.
"""

from usdface.findings.finding import Finding, finding, severest, timed

__all__ = ["Finding", "finding", "severest", "timed"]
