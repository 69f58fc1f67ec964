import os
import subprocess
import sys
from pathlib import Path

import pytest

from usdface.cli.threads import BLAS_THREADS, one_blas_thread

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
RUN = """
import os, sys
from usdface.cli import main
os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: int(sys.argv[2])])
sys.exit(main(["process", sys.argv[1]]))
"""


def test_what_the_environment_says_goes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    first, *others = BLAS_THREADS
    monkeypatch.setenv(first, "3")
    for name in others:
        monkeypatch.delenv(name, raising=False)
    one_blas_thread()
    assert [os.environ[name] for name in BLAS_THREADS] == ["3", "1", "1"]


@pytest.mark.skipif(
    not hasattr(os, "sched_setaffinity") or len(os.sched_getaffinity(0)) < 2,
    reason="needs two cores and a system that gives a process less",
)
def test_bytes_do_not_depend_on_the_number_of_cores(tmp_path: Path) -> None:
    shot = tmp_path / "shot.usda"
    for name in ("head.usdc", "take.usdc", "shot.usda"):
        (tmp_path / name).write_bytes((EXAMPLES / name).read_bytes())
    free = {name: value for name, value in os.environ.items() if name not in BLAS_THREADS}
    written = []
    for cores in ("1", "2"):
        words = [sys.executable, "-c", RUN, str(shot), cores]
        subprocess.run(words, env=free, check=True, capture_output=True)
        layers = (tmp_path / "shot.usdface").iterdir()
        written.append({layer.name: layer.read_bytes() for layer in layers})
    assert written[0].keys() == {"solve.usdc", "express.usdc"}
    assert written[0] == written[1]
