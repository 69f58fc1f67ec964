"""CPU time of the starts that a user waits for: `python benchmarks/startup.py`.

The smallest of several runs, user plus system time of the child process: other programs on
the machine lengthen the wall clock, not this.
"""

import resource
import subprocess
import sys

RUNS = 9
STARTS = {
    "python -c pass": ["-c", "pass"],
    "import usdface": ["-c", "import usdface"],
    "usdface --help": ["-c", "import sys; sys.argv = ['usdface', '--help']; "
                             "from usdface.cli import main; sys.exit(main())"],
    "import usdface.pipeline": ["-c", "import usdface.pipeline"],
}  # fmt: skip


def cpu_seconds(arguments: list[str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


if __name__ == "__main__":
    for name, arguments in STARTS.items():
        seconds = min(cpu_seconds(arguments) for _ in range(RUNS))
        print(f"{name:<24} {1000 * seconds:6.0f} ms CPU")
