"""The HTML file of a page: data, scripts and styles in one, without external resources.

The scripts are ES modules in an import map of ``data:`` addresses, so they stay the modules that
they are in `assets`. A content security policy forbids every request, and every script of the page
itself but those whose hash it names. Text from outside is JSON without ``<``, and the scripts
insert it as text only (`assets/dom.js`).
"""

import base64
import hashlib
import html
import json
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.resources import files
from typing import Any, Literal

from usdface import __version__
from usdface.findings import Finding
from usdface.page.packed_data import pack_data

__all__ = ["MODULES", "finding_lines", "page_html"]

# Modules of the pages; each is "usdface/NAME" to the others, three.js is "three".
MODULES = (
    "bind",
    "blend_shapes",
    "character",
    "chart",
    "curves",
    "data",
    "dom",
    "footage",
    "heat",
    "markers",
    "places",
    "player",
    "rules",
    "skin",
    "sliders",
    "stage",
    "timeline",
    "verdict",
    "view",
)


def finding_lines(findings: Iterable[Finding]) -> list[dict[str, str]]:
    """Return findings as lines of text for a page."""
    return [
        {"code": f.code, "severity": f.severity, "where": f.where, "message": f.message}
        for f in findings
    ]


def page_html(
    kind: Literal["view", "bind"], title: str, about: str, data: Mapping[str, Any]
) -> str:
    """Return a page.

    Parameters
    ----------
    kind : {"view", "bind"}
    title : str
        Any text.
    about : str
        A line beside the title, any text.
    data : mapping
        A tree for `usdface.page.packed_data.pack_data`.
    """
    packed = pack_data(data)
    imports = {"three": _address("three.js")}
    imports |= {f"usdface/{name}": _address(f"{name}.js") for name in MODULES}
    scripts = {
        "importmap": json.dumps({"imports": imports}),
        "module": f'import "usdface/{kind}";',
    }
    style = _asset("page.css")
    policy = (
        "default-src 'none'; img-src data: blob:; base-uri 'none'; form-action 'none'; "
        f"style-src {_hash(style)}; "
        f"script-src {' '.join(_hash(text) for text in scripts.values())} data:"
    )
    lines = [
        "<!doctype html>",
        '<html lang="en">',
        '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
        '<meta name="viewport" content="width=device-width">',
        f'<meta name="generator" content="usdface {__version__}">',
        '<link rel="icon" href="data:,">',
        f"<title>{html.escape(_one_line(title))}</title>",
        f"<style>{style}</style>",
        f"<header><h1>{html.escape(_one_line(title))}</h1>"
        f'<span class="about">{html.escape(_one_line(about))}</span></header>',
        '<main id="stage"></main>',
        '<div id="verdict" hidden></div>',
        '<div id="legend" hidden></div>',
        '<aside id="panel"></aside>',
        '<div id="transport"></div>',
        '<div id="timeline"></div>',
        # "<" ends or begins no element in JSON that has none.
        f'<script type="application/json" id="data">{packed.text.replace("<", chr(92) + "u003c")}'
        "</script>",
        f'<script type="text/plain" id="block">{packed.block}</script>',
        *(f'<script type="{kind}">{text}</script>' for kind, text in scripts.items()),
        "</html>",
    ]
    return "\n".join(lines) + "\n"


def _one_line(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)


@cache
def _asset(name: str) -> str:
    return (files("usdface.page") / "assets" / name).read_text(encoding="utf-8")


def _address(name: str) -> str:
    encoded = base64.b64encode(_asset(name).encode()).decode("ascii")
    return f"data:text/javascript;base64,{encoded}"


def _hash(text: str) -> str:
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"
