"""The statements of a file in FCL, with their lines."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from usdface.errors import InputError

__all__ = ["BARE", "NAMED", "Statement", "statements"]

_COMMENTS = {"(*": "*)", "/*": "*/"}
_TOKEN = re.compile(
    r"""(?P<space>\s+|//[^\n]*)
    |(?P<word>[^\W\d]\w*)
    |(?P<number>[-+]?(?:\d+\.(?!\.)\d*|\.\d+|\d+)(?:[eE][-+]?\d+)?|[-+]inf\b)
    |(?P<mark>:=|\.\.|[:;(),*/^|+-])""",
    re.VERBOSE,
)


@dataclass(frozen=True, slots=True)
class Statement:
    """Words up to a semicolon, and the line of the first."""

    line: int
    words: tuple[str, ...]

    @property
    def first(self) -> str:
        """The first word, in capitals."""
        return self.words[0].upper()

    def __str__(self) -> str:
        return " ".join(self.words)


# These stand alone or with a name, without a semicolon.
BARE = {"VAR_INPUT", "VAR_OUTPUT", "VAR"}
NAMED = {"FUNCTION_BLOCK", "FUZZIFY", "DEFUZZIFY", "RULEBLOCK"}


def _tokens(name: str, text: str) -> list[tuple[int, str]]:
    """Return each word with its line."""
    tokens = []
    at, line = 0, 1
    while at < len(text):
        if closing := _COMMENTS.get(text[at : at + 2]):
            end = text.find(closing, at + 2)
            if end < 0:
                raise InputError(f"{name}, line {line}: a comment has no end; the file is cut off")
            line += text.count("\n", at, end)
            at = end + 2
            continue
        match = _TOKEN.match(text, at)
        if match is None:
            raise InputError(f"{name}, line {line}: {text[at : at + 20].split()[0]!r} is no FCL")
        if match.lastgroup != "space":
            tokens.append((line, match.group()))
        at = match.end()
        line += match.group().count("\n")
    return tokens


def statements(name: str, text: str) -> Iterator[Statement]:
    """Cut the text into statements: up to a semicolon, or a keyword that needs none."""
    tokens = _tokens(name, text)
    after = [word for _, word in tokens[1:]] + ["", ""]
    words: list[str] = []
    begin = 0
    for i, (line, word) in enumerate(tokens):
        if words and _begins(words, word.upper(), (after[i], after[i + 1])):
            yield Statement(begin, tuple(words))
            words = []
        begin = begin if words else line
        words += [word] if word != ";" else []
        if words and (word == ";" or _ends(words)):
            yield Statement(begin, tuple(words))
            words = []
    if words:
        raise InputError(f"{name}, line {begin}: {words[0]!r} has no end; the file is cut off")


def _begins(words: list[str], word: str, after: tuple[str, str]) -> bool:
    """Whether a statement begins in front of which the other has no name or no semicolon.

    fuzzylite leaves blocks without a name, and rules without a semicolon.
    """
    first = words[0].upper()
    next_rule = word == "END_RULEBLOCK" or (word == "RULE" and after[1] == ":")
    if first == "RULEBLOCK" and len(words) == 1:
        return next_rule or after[0] == ":"
    if first == "FUNCTION_BLOCK" and len(words) == 1:
        return word in BARE
    return next_rule and first == "RULE" and ":" in words


def _ends(words: list[str]) -> bool:
    first = words[0].upper()
    alone = first in BARE or first.startswith("END_")
    return alone or (first in NAMED and len(words) == 2)
