"""Real files there and back: `python benchmarks/conversions.py`.

Every glTF and USD file of the real data goes to the other format and back. Per file: what the
certificates of the two conversions say, what the Khronos validator and UsdValidation say, and
which codes were reported; or why it was refused. See README.md.
"""

import json
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path.insert(0, str(ROOT / "tests"))
from round_trips import RoundTrip, round_trip, sources  # noqa: E402


def khronos(path: Path) -> dict[str, Any]:
    """Return the report of the Khronos validator (npm install --no-save gltf-validator)."""
    command = ["node", str(ROOT / "tests" / "gltf_validate.mjs"), str(path)]
    return json.loads(subprocess.run(command, capture_output=True, check=True, cwd=ROOT).stdout)


def row(trip: RoundTrip) -> list[str]:
    if trip.refused:
        return ["refused", "", "", "", "", trip.refused]
    certified = [leg for leg in trip.legs if leg.certificate]
    most = {
        key: max(leg.certificate[key] for leg in certified)
        for key in ("weight_error_max", "time_drift_s")
    }
    judged = [error for leg in trip.legs for error in leg.judged]
    same = "yes" if trip.names[0] == trip.names[1] else "no"
    codes = sorted({code for leg in trip.legs for code in leg.codes})
    return [
        f"{max(leg.vertices for leg in certified):.1g}",
        f"{most['weight_error_max']:.1g}",
        f"{most['time_drift_s']:.1g}",
        same,
        str(len(judged)),
        ", ".join(codes),
    ]


def main() -> None:
    if not SHARED.is_dir():
        sys.exit(f"real data is not beside this checkout: {SHARED}")
    table = Table(title="there and back")
    for head in ("file", "vertices / diagonal", "weights", "times s", "names", "errors", "codes"):
        table.add_column(head, overflow="fold")
    for path in sources(SHARED):
        with TemporaryDirectory() as folder:
            trip = round_trip(path, Path(folder), khronos)
        table.add_row(str(path.relative_to(SHARED)), *row(trip))
    Console(width=160).print(table)


if __name__ == "__main__":
    main()
