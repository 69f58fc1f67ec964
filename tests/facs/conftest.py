from pathlib import Path

import pytest

from usdface.facs.report import FacsReport, judge_rig
from usdface.io.rigs.files import read_rig_file
from usdface.rigs import Rig

HEAD = Path(__file__).parents[2] / "examples" / "head.usdc"


@pytest.fixture(scope="session")
def head() -> Rig:
    """The example's head."""
    return read_rig_file(HEAD)[0]


@pytest.fixture(scope="session")
def judged_head(head: Rig) -> FacsReport:
    return judge_rig(head, ())
