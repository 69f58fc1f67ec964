"""Every file of a composed stage, known answers on a stage that uses each kind once."""

from pathlib import Path

import pytest
from composed import LAYERS, PICTURES, compose
from pxr import Sdf, Usd, UsdUtils

from usdface.io.usd.dependencies import dependencies
from usdface.io.usd.stage import is_usd


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    compose(tmp_path)
    (tmp_path / "rig.usda").write_text("#usda 1.0\n")
    return tmp_path


def test_layers_clips_variants_and_assets_are_found(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    found = dependencies(folder / "lay/rig.usda")
    names = [path.relative_to(folder).as_posix() for path in found]
    if Usd.GetVersion() < (0, 26, 8):  # before, USD reports no asset that a variable names
        names.append("tex/unseen.png")
    assert sorted(names) == sorted([*LAYERS, *PICTURES, "rig.usda", "lay/broken.usda"])
    assert found == dependencies(folder / "lay/rig.usda")
    assert capfd.readouterr() == ("", "")


def test_a_variable_of_a_stronger_layer_counts(folder: Path) -> None:
    text = '#usda 1.0\n(expressionVariables = { string V = "pay" })\n'
    weak = text + 'def "B" (references = @`"./lay/${V}.usda"`@</A>)\n{\n}\n'
    (folder / "weak.usda").write_text(weak)
    strong = text.replace("pay", "var").replace("})", "}\nsubLayers = [@weak.usda@])")
    (folder / "strong.usda").write_text(strong)
    assert folder / "lay/var.usda" in dependencies(folder / "strong.usda")


def test_results_that_only_the_file_itself_names_can_be_set_apart(folder: Path) -> None:
    root, layer = folder / "root.usda", folder / "lay/pay.usda"
    root.write_text("#usda 1.0\n(subLayers = [@lay/pay.usda@, @more.usda@])\n")
    (folder / "more.usda").write_text("#usda 1.0\n")
    assert layer not in dependencies(root, apart=[layer])
    (folder / "more.usda").write_text("#usda 1.0\n(subLayers = [@lay/pay.usda@])\n")
    assert layer in dependencies(root, apart=[layer])


def test_a_package_is_one_file(folder: Path) -> None:
    root = folder / "root.usda"
    root.write_text('#usda 1.0\ndef "A"\n{\n    asset file = @tex/skin.png@\n}\n')
    package = folder / "a.usdz"
    assert UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(root)), str(package))
    assert dependencies(package) == []
    inside = (
        '#usda 1.0\n(subLayers = [@a.usdz@])\ndef "B"\n{\n    asset a = @a.usdz[0/skin.png]@\n}\n'
    )
    root.write_text(inside)
    assert dependencies(root) == [package]


def test_what_is_not_usd_names_nothing(folder: Path) -> None:
    assert not is_usd(folder / "take.csv") and is_usd(folder / "none.usdc")
    assert dependencies(folder / "lay/broken.usda") == dependencies(folder / "none.usda") == []


def test_a_file_without_a_suffix_is_an_asset_like_any(tmp_path: Path) -> None:
    (tmp_path / "texture").write_bytes(b"no layer")
    (tmp_path / "a.usda").write_text(
        '#usda 1.0\ndef "A" {\n    asset file = @./texture@\n    asset none = @./.@\n}\n'
    )
    assert dependencies(tmp_path / "a.usda") == [tmp_path / "texture"]
