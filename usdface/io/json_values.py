"""Names and numbers in JSON files that people write."""

__all__ = ["checked_object", "whole_number"]

_DIGITS = 20  # of a whole number; those of 64 bits have 19


def checked_object(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """Return an object of JSON; of a name that occurs twice JSON keeps the last without a word.

    To pass to `json.loads` as `object_pairs_hook`.

    Raises
    ------
    ValueError
        If a name occurs twice.
    """
    found: dict[str, object] = {}
    for name, value in pairs:
        if name in found:
            raise ValueError(f"{name!r} occurs twice; keep one")
        found[name] = value
    return found


def whole_number(text: str) -> int | float:
    """Return a whole number; as a float, perhaps infinite, where it has more digits than any has.

    To pass to `json.loads` as `parse_int`: an int that is larger than any float is no number that
    can be compared or converted.
    """
    return int(text) if len(text) < _DIGITS else float(text)
