"""What a shot's fuzzy system answers, and why: `usdface fuzzy explain` and `fuzzy neutral`."""

from pathlib import Path

from usdface.correction.neutral_check import RestingAnswer, resting_answers
from usdface.errors import InputError
from usdface.explanation import Explanation, explained
from usdface.expression_system import ExpressionSystem
from usdface.io.usd.layers import open_shot
from usdface.io.usd.shot import Shot, read_shot
from usdface.io.usd.stage import Stage
from usdface.options import ProcessOptions
from usdface.pipeline.schemas import register_schemas
from usdface.result import OnStep, Steps
from usdface.retarget_shot import animate

__all__ = ["explain", "resting"]


def explain(path: Path, on_step: OnStep | None = None) -> Explanation:
    """Process a shot without writing, and keep what its corrector saw and did.

    Raises
    ------
    InputError
        If the shot cannot be processed or has no fuzzy system.
    """
    register_schemas()
    steps = Steps(on_step)
    with steps("read"):
        stage, shot, system = _asked(path)
    animated = animate(stage, shot, ProcessOptions(), steps)
    return explained(shot, system, animated)


def resting(path: Path, on_step: OnStep | None = None) -> tuple[RestingAnswer, ...]:
    """Ask the fuzzy paper's system and that of a shot about a neutral face.

    Raises
    ------
    InputError
        If the shot cannot be read or has no fuzzy system.
    """
    register_schemas()
    steps = Steps(on_step)
    with steps("read"):
        _, shot, system = _asked(path)
    with steps("play"):
        return resting_answers(shot.rig, shot.setup, system)


def _asked(path: Path) -> tuple[Stage, Shot, ExpressionSystem]:
    stage = open_shot(path)
    shot, _ = read_shot(stage, str(path))
    if shot.system is None:
        raise InputError(f"{path} has no fuzzy system to ask; `usdface shot` designs one")
    return stage, shot, shot.system
