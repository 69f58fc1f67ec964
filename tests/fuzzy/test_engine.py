"""The engine stands alone, and its example is true."""

import ast
import doctest
from pathlib import Path

import usdface.fuzzy

ALLOWED = {"usdface.arrays", "usdface.errors", "usdface.findings"}


def test_the_example_of_the_engine_is_true() -> None:
    found = doctest.testmod(usdface.fuzzy)
    assert found.attempted > 5 and not found.failed


def test_the_engine_imports_nothing_of_usdface_that_knows_a_face() -> None:
    imported = set()
    for path in Path(usdface.fuzzy.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module:
                imported.add(node.module)
            elif isinstance(node, ast.Import):
                imported |= {alias.name for alias in node.names}
    ours = {name for name in imported if name.startswith("usdface")}
    assert {name for name in ours if not name.startswith("usdface.fuzzy.")} <= ALLOWED
