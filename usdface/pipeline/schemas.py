"""Our prim types, where it is not too late for them."""

from contextlib import suppress

from usdface.errors import SchemaError
from usdface.schemas import register

__all__ = ["register_schemas"]


def register_schemas() -> None:
    """Let USD know our prim types; in a host where it is too late, reading works without."""
    with suppress(SchemaError):
        register()
