"""The dock of usdview explains a frame in the words of `usdface fuzzy explain`."""

from typing import Any

import pytest
from usdface_usdview.explanation_text import explanation_text

from usdface.cli.print_fuzzy import print_explanation


def test_the_dock_describes_the_emotions_as_the_command(
    capsys: pytest.CaptureFixture[str],
) -> None:
    facts: dict[str, Any] = {
        "frame": 72,
        "time_s": 1.2,
        "emotions": {"joy": 0.5, "fear": 0.0},
        "by_rules": {"joy": 0.4, "fear": 0.08},
        "poses_shown": {"joy": 0.99, "fear": 0.0},
        "held_back": {"joy": ["brows", "mouth"]},
        **{"rules": [], "features": [], "halves": {}, "closed": {}, "weights": {}},
    }
    print_explanation(facts)
    printed = [line for line in capsys.readouterr().out.splitlines() if line]
    shown = explanation_text(facts).splitlines()
    assert shown[:-1] == printed[:-1] and len(shown) == 7
    assert shown[-1] == "no rule fires" and printed[-1].startswith(shown[-1])
