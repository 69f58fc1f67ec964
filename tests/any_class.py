"""A stand-in for a host's module of classes: any name in it is a class, which takes any values."""

from types import ModuleType

__all__ = ["AnyClass"]


class AnyClass(ModuleType):
    """The module."""

    def __getattr__(self, name: str) -> type:
        if name.startswith("__"):
            raise AttributeError(name)
        made = type(name, (), {"__init__": lambda self, *values, **options: None})
        setattr(self, name, made)
        return made
