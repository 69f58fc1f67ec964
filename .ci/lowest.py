"""Print the lowest versions that pyproject.toml states, as constraints for pip.

Of the dependencies and of the extras that users install, not of the tools of the tests. A
requirement is ``name>=version``, with or without an environment marker; the version is a published
one, because pip takes ``==`` literally.
"""

import re
import tomllib
from pathlib import Path

EXTRAS = ("compression", "plot")


def lowest(requirement: str) -> str:
    """Return ``name==version; marker`` for ``name>=version; marker``."""
    needed, *marker = requirement.split(";")
    found = re.fullmatch(r"([\w.-]+)>=([\w.]+)", needed.strip())
    if not found:
        raise SystemExit(f"pyproject.toml: {requirement!r} states no lowest version alone")
    return ";".join(["{}=={}".format(*found.groups()), *marker])


def main() -> None:
    """Print a line for each requirement."""
    path = Path(__file__).parents[1] / "pyproject.toml"
    project = tomllib.loads(path.read_text())["project"]
    extras = project["optional-dependencies"]
    for requirement in (*project["dependencies"], *(r for e in EXTRAS for r in extras[e])):
        print(lowest(requirement))


if __name__ == "__main__":
    main()
