"""What a shot's fuzzy system answers, and why: `usdface fuzzy explain` and `fuzzy neutral`."""

from pathlib import Path

from usdface.explain import Explanation, explain_shot
from usdface.outcome import OnStep, Steps
from usdface.pipeline.schemas import register_schemas
from usdface.resting import RestingAnswer, resting_answers

__all__ = ["explain", "resting"]


def explain(path: Path, on_step: OnStep | None = None) -> Explanation:
    """Process a shot without writing, and keep what its corrector saw and did.

    Raises
    ------
    InputError
        If the shot cannot be processed or has no fuzzy system.
    """
    register_schemas()
    return explain_shot(path, Steps(on_step))


def resting(path: Path, on_step: OnStep | None = None) -> tuple[RestingAnswer, ...]:
    """Ask the fuzzy paper's system and that of a shot about a neutral face.

    Raises
    ------
    InputError
        If the shot cannot be read or has no fuzzy system.
    """
    register_schemas()
    return resting_answers(path, Steps(on_step))
