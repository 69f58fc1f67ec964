import hashlib
import json
import re
from html.parser import HTMLParser
from pathlib import Path

from usdface.page import document
from usdface.page.document import MODULES, page_html

ASSETS = Path(document.__file__).parent / "assets"
HOSTILE = "</script><script>alert(1)</script><!-- \u2028 \x00\x1b & \"'"


class _Elements(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.started: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, str] = {}

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.started.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        tag, attributes = self.started[-1] if self.started else ("", {})
        self.texts.setdefault(attributes.get("id") or attributes.get("type") or tag, data)


def elements(text: str) -> _Elements:
    parser = _Elements()
    parser.feed(text)
    return parser


def test_text_from_outside_makes_no_element() -> None:
    plain = elements(page_html("view", "a", "b", {"name": "c"}))
    hostile = elements(page_html("view", HOSTILE, HOSTILE, {HOSTILE: [HOSTILE]}))
    assert [tag for tag, _ in hostile.started] == [tag for tag, _ in plain.started]
    assert json.loads(hostile.texts["data"]) == {HOSTILE: [HOSTILE]}
    assert hostile.texts["title"] == HOSTILE.translate({0: " ", 0x1B: " ", 0x2028: " "})


def test_the_policy_names_the_scripts_and_no_place() -> None:
    page = elements(page_html("view", "a", "b", {}))
    policy = next(a["content"] for tag, a in page.started if "http-equiv" in a) or ""
    assert policy.startswith("default-src 'none'") and "http" not in policy
    scripts = [
        kind for tag, a in page.started if (kind := a.get("type")) in ("importmap", "module")
    ]
    assert scripts == ["importmap", "module"] and policy.count("'sha256-") == 3
    addresses = [v for _, a in page.started for n, v in a.items() if n in ("src", "href")]
    assert addresses == ["data:,"]


def test_every_module_of_the_assets_is_in_the_page_and_imports_only_such() -> None:
    there = {path.stem for path in ASSETS.glob("*.js")}
    assert there == {*MODULES, "three"}
    known = {"three", *(f"usdface/{name}" for name in MODULES)}
    for name in MODULES:
        text = (ASSETS / f"{name}.js").read_text(encoding="utf-8")
        assert set(re.findall(r'from "([^"]+)"', text)) <= known
        assert "innerHTML" not in text and "insertAdjacentHTML" not in text


def test_the_bundle_of_three_is_the_one_that_was_built_with_its_licence() -> None:
    bundle = (ASSETS / "three.js").read_bytes()
    expected = (ASSETS / "three.sha256").read_text(encoding="utf-8").split()[0]
    assert hashlib.sha256(bundle).hexdigest() == expected, "python .ci/three/build.py"
    notice = bundle[:2000].decode()
    assert "The MIT License" in notice and "three.js authors" in notice


def test_the_same_data_gives_the_same_page() -> None:
    data = {"a": [1, 2.5, "x"]}
    assert page_html("view", "t", "u", data) == page_html("view", "t", "u", data)
