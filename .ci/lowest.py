"""Print the lowest versions that pyproject.toml states, as constraints for pip.

Of what the package needs and of the extras that users install; the tools of the tests are none of
theirs. A requirement is ``name>=version`` with a version that is published: pip takes ``==`` by
the word.
"""

import re
import tomllib
from pathlib import Path

EXTRAS = ("compression", "fast", "plot")


def lowest(requirement: str) -> str:
    """Return ``name==version`` for ``name>=version``."""
    found = re.fullmatch(r"([\w.-]+)>=([\w.]+)", requirement)
    if not found:
        raise SystemExit(f"pyproject.toml: {requirement!r} states no lowest version alone")
    return "{}=={}".format(*found.groups())


def main() -> None:
    """Print a line for each requirement."""
    path = Path(__file__).parents[1] / "pyproject.toml"
    project = tomllib.loads(path.read_text())["project"]
    extras = project["optional-dependencies"]
    for requirement in (*project["dependencies"], *(r for e in EXTRAS for r in extras[e])):
        print(lowest(requirement))


if __name__ == "__main__":
    main()
