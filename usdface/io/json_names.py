"""Names in JSON files that people write."""

__all__ = ["unique_names"]


def unique_names(pairs: list[tuple[str, object]]) -> dict[str, object]:
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
