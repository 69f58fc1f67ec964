"""YAML files of other programs, OpenCV's FileStorage among them, read with limits."""

from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from usdface.errors import InputError
from usdface.io.takes.text_table import read_text

__all__ = ["read_yaml"]


def read_yaml(path: Path) -> Any:
    """Return the maps, lists, numbers and texts of a file, without tags.

    Keys are texts, an empty value is None; numbers may be NaN or infinite.

    Raises
    ------
    InputError
        If the file is missing, unreadable or no YAML, or a key occurs twice or a value is an alias.
    """
    text = read_text(path)
    if text.startswith("%YAML:"):  # OpenCV's, which no version of YAML has
        text = "#" + text
    try:
        return yaml.load(text, _Loader)  # of texts, lists and maps alone
    except RecursionError as error:
        raise InputError(
            f"{path}: levels nested too deeply; expected YAML as its program writes it",
            "SCHEMA_BROKEN",
        ) from error
    except yaml.MarkedYAMLError as error:
        raise _not_yaml(path, error) from error
    except (OverflowError, ValueError, yaml.YAMLError) as error:  # of escapes, too: \U00110000
        raise InputError(
            f"{path} is no YAML: {str(error).splitlines()[0]}; is it in another format?",
            "SCHEMA_BROKEN",
        ) from error


class _Loader(yaml.BaseLoader):
    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Compose a value; not an alias, since few of them can stand for any number of values."""
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise _error("an alias; write its value in its place", mark)
        return super().compose_node(parent, index)

    def construct_scalar(self, node: yaml.ScalarNode) -> Any:
        """Return a number, a text, or None: by YAML 1.1 ``1e-05`` would be a text."""
        if node.style or node.value == "":
            return node.value if node.style else None
        try:
            return float(node.value.replace(".Nan", "nan").replace(".Inf", "inf"))
        except ValueError:
            return node.value

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Return a map; of a key that occurs twice YAML's own would keep the last value."""
        found: dict[Hashable, Any] = {}
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise _error("a key that is no text", key.start_mark)
            if key.value in found:
                raise _error(f"{key.value[:40]!r} occurs twice; keep one of them", key.start_mark)
            found[key.value] = self.construct_object(value, deep)
        return found


def _error(problem: str, mark: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=mark)


def _not_yaml(path: Path, error: yaml.MarkedYAMLError) -> InputError:
    mark = error.problem_mark or error.context_mark
    where = f"{path}, line {mark.line + 1}" if mark else str(path)
    problem = " ".join(part for part in (error.context, error.problem) if part)
    if "<stream end>" in problem or "end of stream" in problem:
        return InputError(f"{where}: the file ends within a value; copy it again", "FILE_CUT_OFF")
    return InputError(
        f"{where}: {problem}; expected YAML as its program writes it", "SCHEMA_BROKEN"
    )
