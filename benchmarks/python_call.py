"""`process` called from Python beside the command: `python benchmarks/python_call.py`.

Processor time of the example shot while another process keeps a core busy: with the command, from
Python as a host calls it, and from a host that sets the threads of its linear algebra itself. All
take turns, figures are medians. Exit status 1 if Python takes more than 1.3 times the command's.
"""

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

from usdface.blas_threads import BLAS_THREADS

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
AIM = 1.3
CALL = "import usdface; usdface.process('shot.usda')"
CALLS = {
    "usdface process": ["-m", "usdface", "process", "shot.usda"],
    "from Python": ["-c", CALL],
    "from Python, numpy loaded before": ["-c", f"import numpy, scipy.linalg; {CALL}"],
}


def cpu_seconds(words: list[str], folder: Path) -> float:
    free = {k: v for k, v in os.environ.items() if k not in (*BLAS_THREADS, "OMP_NUM_THREADS")}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, *words], cwd=folder, env=free, check=True, stdout=subprocess.DEVNULL
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--turns", type=int, default=5)
    turns = parser.parse_args().turns
    with tempfile.TemporaryDirectory() as place:
        for name in ("head.usdc", "take.usdc", "shot.usda"):
            shutil.copy(EXAMPLES / name, place)
        busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
        try:
            runs = [
                {d: cpu_seconds(w, Path(place)) for d, w in CALLS.items()} for _ in range(turns)
            ]
        finally:
            busy.kill()
            busy.wait()
    command, *_ = CALLS
    ratios = {call: median([run[call] / run[command] for run in runs]) for call in CALLS}
    for call, ratio in ratios.items():
        print(f"{call:<36} {median([run[call] for run in runs]):6.2f} s CPU {ratio:6.2f}")
    return int(max(ratios.values()) > AIM)


if __name__ == "__main__":
    sys.exit(main())
