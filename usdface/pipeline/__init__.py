"""The jobs: one public function and one module for each command.

A character and a take become USD (`make_rig`, `make_take`), or arrays (`read_rig`, `read_take`,
`read_bind`). The two come together in a shot: `make_shot` writes one, `set_up` authors one on a
stage that a host holds open; `make_markers` finds places for markers, `calibrate` the size of a
performer's movements. `process` is the main job: it retargets and corrects a shot and writes the
layers; `apply` does the same on an open stage, `process_sequence` for many shots. Around it, scenes
go to and from glTF (`export_scene`, `import_scene`), files are checked (`check`), and the
expression layer is fitted, converted and explained (`fit_fuzzy`, `convert_fuzzy`, `explain`,
`check_neutral`).

A function is imported on first access, with only the libraries that it uses.
"""

from typing import TYPE_CHECKING

from usdface.lazy import lazy_names

if TYPE_CHECKING:
    from usdface.pipeline.bind_page import make_bind_page
    from usdface.pipeline.calibration import calibrate
    from usdface.pipeline.checking import check
    from usdface.pipeline.conforming import conform
    from usdface.pipeline.explaining import check_neutral, explain
    from usdface.pipeline.formats import list_formats
    from usdface.pipeline.fuzzy_files import convert_fuzzy, write_paper_system
    from usdface.pipeline.fuzzy_fit import fit_fuzzy
    from usdface.pipeline.long_take import solve_pieces
    from usdface.pipeline.markers import make_markers
    from usdface.pipeline.plugins import list_plugins
    from usdface.pipeline.processing import apply, process
    from usdface.pipeline.reading import read_bind, read_result, read_rig, read_take
    from usdface.pipeline.rig import make_rig
    from usdface.pipeline.scenes import export_scene, import_scene
    from usdface.pipeline.sequence import process_sequence
    from usdface.pipeline.setting_up import set_up
    from usdface.pipeline.shot import make_shot
    from usdface.pipeline.take import make_take
    from usdface.pipeline.viewing import view

__all__ = [
    "apply",
    "calibrate",
    "check",
    "check_neutral",
    "conform",
    "convert_fuzzy",
    "explain",
    "export_scene",
    "fit_fuzzy",
    "import_scene",
    "list_formats",
    "list_plugins",
    "make_bind_page",
    "make_markers",
    "make_rig",
    "make_shot",
    "make_take",
    "process",
    "process_sequence",
    "read_bind",
    "read_result",
    "read_rig",
    "read_take",
    "set_up",
    "solve_pieces",
    "view",
    "write_paper_system",
]

_HOMES = {
    "bind_page": ("make_bind_page",),
    "calibration": ("calibrate",),
    "checking": ("check",),
    "conforming": ("conform",),
    "explaining": (
        "check_neutral",
        "explain",
    ),
    "formats": ("list_formats",),
    "fuzzy_files": (
        "convert_fuzzy",
        "write_paper_system",
    ),
    "fuzzy_fit": ("fit_fuzzy",),
    "long_take": ("solve_pieces",),
    "markers": ("make_markers",),
    "plugins": ("list_plugins",),
    "processing": (
        "apply",
        "process",
    ),
    "reading": (
        "read_bind",
        "read_result",
        "read_rig",
        "read_take",
    ),
    "rig": ("make_rig",),
    "scenes": (
        "export_scene",
        "import_scene",
    ),
    "sequence": ("process_sequence",),
    "setting_up": ("set_up",),
    "shot": ("make_shot",),
    "take": ("make_take",),
    "viewing": ("view",),
}

__getattr__, __dir__ = lazy_names(__name__, _HOMES)
