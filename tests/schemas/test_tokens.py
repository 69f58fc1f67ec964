import re
from pathlib import Path

from pxr import Sdf

from usdface.options import solve_settings
from usdface.schemas import plugin_dir, tokens

SCHEMA = Sdf.Layer.FindOrOpen(str(plugin_dir() / "schema.usda"))
CONTRACT = Path(__file__).parents[2] / "docs" / "architecture.md"
NAMES = {value for name in tokens.__all__ if isinstance(value := getattr(tokens, name), str)}
NAMES -= {tokens.SOLVE_PREFIX}
NAMES |= {f"{tokens.SOLVE_PREFIX}{name}" for name in solve_settings()}


def classes() -> list[Sdf.PrimSpec]:
    return [spec for spec in SCHEMA.rootPrims if spec.specifier == Sdf.SpecifierClass]


def test_every_declared_name_has_a_token_and_every_token_is_declared() -> None:
    declared = {spec.name for spec in classes()}
    declared |= {prop.name for spec in classes() for prop in spec.properties}
    # `points` is inherited; emotions are named by the fuzzy system's outputs
    declared |= {tokens.POINTS, tokens.EMOTION_PREFIX, tokens.PIN_PREFIX, tokens.RESIDUAL_PREFIX}
    assert sorted(declared - NAMES) == [], "declare them in usdface/schemas/tokens.py"
    assert sorted(NAMES - declared) == [], "declare them in usdface/schemas/schema.usda"


def test_fallback_types_are_the_declared_ones() -> None:
    declared = {spec.name: list(spec.customData["fallbackTypes"]) for spec in classes()}
    assert declared == {name: [fallback] for name, fallback in tokens.FALLBACK_TYPES.items()}


def test_the_contract_names_the_same_attributes() -> None:
    text = CONTRACT.read_text(encoding="utf-8")
    written = set(re.findall(r"`(usdface:[A-Za-z][A-Za-z:]*)(?:<name>)?`", text))
    known = {name for name in NAMES if name.startswith("usdface:")}
    assert sorted(known - written) == [], "the tables of docs/architecture.md have a row for each"
    assert sorted(written - known) == [], "docs/architecture.md names them, the schema does not"
