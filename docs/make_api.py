"""Write docs/api.md from the docstrings of the public names: ``python docs/make_api.py``."""

import inspect
from pathlib import Path

import griffe

import usdface

GROUPS = {
    "The job": ("process", "process_sequence", "apply", "retarget"),
    "Shots": ("make_shot", "set_up", "assemble_shot", "make_markers", "calibrate"),
    "Files in": ("make_rig", "make_take", "read_rig", "read_take", "read_bind"),
    "Pages": ("view", "make_bind_page"),
    "Scenes and checks": ("export_scene", "import_scene", "check"),
    "The expression layer": (
        "explain",
        "check_neutral",
        "fit_fuzzy",
        "convert_fuzzy",
        "write_paper_system",
    ),
    "Arrays": (
        "Shot",
        "ShotResult",
        "Rig",
        "Mesh",
        "BlendShape",
        "MarkerTake",
        "WeightsTake",
        "RetargetSetup",
        "Binding",
        "Calibration",
        "PerformerFace",
        "Expression",
        "Pin",
        "ExpressionSystem",
        "FuzzySystem",
    ),
    "Results and progress": ("Result", "Explanation", "Finding", "finding", "Step"),
    "Options": tuple(name for name in usdface.__all__ if name.endswith("Options")),
    "Formats of other packages": (
        "list_formats",
        "TakeReader",
        "RigReader",
        "ExportTarget",
        "RawTake",
        "finish_take",
        "check_size",
    ),
    "Errors": (
        "UsdFaceError",
        "InputError",
        "SchemaError",
        "SolveError",
        "OutputError",
        "PluginError",
        "Cancelled",
    ),
}
INTRODUCTION = """# The Python API

Made from the docstrings by `python docs/make_api.py`; the tests run every example, in a folder
beside `examples/`. Arrays are in metres and seconds, Y up; the letters of their shapes are those of
[architecture.md](architecture.md#letters-and-words). Functions take keywords beyond the first
arguments. Those that do a job return a [`Result`](#result), and take `on_progress`: a function that
is called with a [`Step`](#step) and ends the job by raising.
"""


def page() -> str:
    """Return the page as Markdown."""
    listed = [name for names in GROUPS.values() for name in names]
    assert sorted(listed) == sorted(usdface.__all__), set(usdface.__all__) ^ set(listed)
    parts = [INTRODUCTION]
    for title, names in GROUPS.items():
        links = ", ".join(f"[`{name}`](#{name.lower()})" for name in names)
        parts.append(f"* {title}: {links}")
    for title, names in GROUPS.items():
        parts.append(f"\n## {title}")
        parts += [_entry(name) for name in names]
    return "\n".join(parts) + "\n"


def _entry(name: str) -> str:
    public = getattr(usdface, name)
    text = inspect.getdoc(public) or ""
    lines = [f"\n### {name}\n", "```text", _signature(name, public), "```\n"]
    for section in griffe.parse_numpy(griffe.Docstring(text), warnings=False):
        kind = section.kind.value
        if kind == "text":
            lines.append(section.value + "\n")
        elif kind == "examples":
            lines += ["```pycon", *(code for _, code in section.value), "```\n"]
        else:
            lines.append(f"**{kind.capitalize()}**\n")
            lines += [_item(item) for item in section.value]
            lines.append("")
    return "\n".join(lines).rstrip()


def _signature(name: str, public: object) -> str:
    if inspect.isclass(public) and issubclass(public, Exception):
        return f"class {name}({public.__mro__[1].__name__})"
    parameters = []
    starred = False
    for parameter in inspect.signature(public).parameters.values():  # type: ignore[arg-type]
        if parameter.kind is parameter.KEYWORD_ONLY and not starred:
            parameters.append("*")
            starred = True
        optional = parameter.default is not parameter.empty
        parameters.append(parameter.name + ("=..." if optional else ""))
    kind = "class " if inspect.isclass(public) else ""
    joined = ", ".join(parameters)
    if len(joined) > 80:
        joined = "\n    " + ",\n    ".join(parameters) + ",\n"
    return f"{kind}{name}({joined})"


def _item(item: object) -> str:
    name, annotation = getattr(item, "name", ""), getattr(item, "annotation", None)
    head = f"`{name}`" if name else ""
    if annotation:
        head += f" ({annotation})" if head else f"{annotation}"
    text = " ".join(str(getattr(item, "description", "")).split())
    return f"* {head}: {text}" if text else f"* {head}"


if __name__ == "__main__":
    Path(__file__).with_name("api.md").write_text(page(), encoding="utf-8")
