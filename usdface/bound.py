"""Where the markers of a shot sit: read from a binding file, proposed, or some of each."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from usdface.findings import Finding, finding
from usdface.io.bind_file import read_bind
from usdface.options import BindOptions
from usdface.rigs import Mesh, Rig
from usdface.setup import Binding, Setup, unbound
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["bound_setup", "proposal_summary"]


def bound_setup(
    character: Rig, take: MarkerTake | WeightsTake, bind: Path | None, options: BindOptions
) -> tuple[Mesh, Setup, tuple[int, ...], list[Finding]]:
    """Read or propose where the markers sit, and find neutral frames where none are named.

    Parameters
    ----------
    character : Rig
    take : MarkerTake or WeightsTake
    bind : Path or None
        The binding file; without one all places are proposed.
    options : BindOptions

    Returns
    -------
    Mesh
        The bound one.
    Setup
    peaks : tuple of int
        Frame indices of the strongest expressions; empty where nothing was proposed.
    list of Finding

    Raises
    ------
    InputError
        If the binding cannot be read, or no places can be proposed.
    """
    setup, findings = read_bind(bind) if bind else (None, [])
    mesh = character.mesh(setup.binding.mesh) if setup else character.face()
    if not isinstance(take, MarkerTake):
        return mesh, setup or unbound(take), (), findings
    # Only here, so that a complete binding loads no search.
    from usdface.binding.propose import neutral_frames, propose

    proposing = setup is None or options.propose
    named = setup is not None and not any(f.code == "NEUTRAL_ASSUMED" for f in findings)
    setup = setup or Setup(Binding((), np.zeros(0, dtype=np.int64)))
    finding_it = options.neutral == "auto" or (proposing and not (named or options.neutral))
    if finding_it or options.neutral:
        findings = [f for f in findings if f.code != "NEUTRAL_ASSUMED"]
    if isinstance(options.neutral, tuple):
        setup = replace(setup, neutral=options.neutral)
    if not proposing:
        if finding_it:
            setup = replace(setup, neutral=neutral_frames(take))
            findings.append(_neutral_found(take, setup))
        return mesh, setup, (), findings
    proposal, more = propose(take, mesh, setup, finding_it)
    if finding_it:
        more.append(_neutral_found(take, proposal.setup))
    return mesh, proposal.setup, proposal.peaks, findings + more


def _neutral_found(take: MarkerTake, setup: Setup) -> Finding:
    message = "the face rests in frames {} to {}: taken as neutral".format(*setup.neutral or (0, 0))
    return finding("NEUTRAL_FOUND", take.source, message)


def proposal_summary(setup: Setup, peaks: tuple[int, ...]) -> dict[str, Any]:
    """Return what the report says of a proposal; nothing where there is none."""
    sure = setup.binding.confidence
    if sure is None or not peaks:
        return {}
    return {
        "neutral frames": "rig" if setup.neutral is None else "{} to {}".format(*setup.neutral),
        "peak frames": ", ".join(map(str, peaks[:6])),
        "confidence, mean": round(float(sure.mean()), 3),
        "confidence, least": round(float(sure.min()), 3),
    }
