import sys
from types import ModuleType

import pytest

from usdface.lazy import lazy_names


@pytest.fixture
def package(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """A package `shop` whose module `shop.till` counts how often it is asked for `price`."""
    shop = ModuleType("shop")
    monkeypatch.setitem(sys.modules, "shop", shop)
    shop.__getattr__, shop.__dir__ = lazy_names("shop", {"till": ("price",)})
    return shop


class Till(ModuleType):
    asked = 0

    @property
    def price(self) -> int:
        self.asked += 1
        return 3


def test_a_name_is_loaded_when_first_asked_for_and_once(
    package: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "price" in dir(package) and "price" not in vars(package)
    with pytest.raises(ModuleNotFoundError):
        _ = package.price
    till = Till("shop.till")
    monkeypatch.setitem(sys.modules, "shop.till", till)
    assert (package.price, package.price, till.asked) == (3, 3, 1)


def test_other_names_are_not_there(package: ModuleType) -> None:
    with pytest.raises(AttributeError, match="module 'shop' has no attribute 'cost'"):
        _ = package.cost
