"""Commands that the help shows: the main job, and two examples of each command."""

__all__ = ["EXAMPLES", "MAIN_JOB"]

MAIN_JOB = (
    "usdface rig head.glb -o rig.usdc",
    "usdface take performance.c3d -o take.usdc",
    "usdface bind rig.usdc --take take.usdc -o bind.html",
    "usdface shot --rig rig.usdc --take take.usdc --bind bind.json -o shot.usda",
    "usdface process shot.usda",
    "usdface view shot.usdface.usda -o shot.html",
)

EXAMPLES: dict[str, tuple[str, str]] = {
    "rig": (
        "usdface rig head.glb -o rig.usdc",
        "usdface rig obj_folder --neutral rest --meters-per-unit 0.01 -o rig.usdc",
    ),
    "take": (
        "usdface take performance.c3d -o take.usdc",
        "usdface take markers.csv --units mm -o take.usdc",
    ),
    "markers": (
        "usdface markers rig.usdc -n 24",
        "usdface markers rig.usdc -n 12 --bind bind.json --figure places.png",
    ),
    "shot": (
        "usdface shot --rig rig.usdc --take take.usdc --bind bind.json -o shot.usda",
        "usdface shot --rig rig.usdc --take take.usdc --neutral auto --write-bind bind.json "
        "--bind-figure bind.png -o shot.usda",
    ),
    "calibrate": (
        "usdface calibrate shot.usda -o performer.json",
        "usdface calibrate range_of_motion.usda --extremes -o performer.json",
    ),
    "process": (
        "usdface process shot.usda --gltf face.glb --sheet faces.png",
        "usdface process shot.usda --exaggeration brows=1.3 --strict --report report.json",
    ),
    "sequence": (
        "usdface sequence show.toml --table show.html",
        "usdface sequence shots/ --workers 4 --report table.json",
    ),
    "conform": (
        "usdface conform reel.otio takes/010.usdc takes/020.usdc -o reel.json",
        "usdface conform reel.edl takes/*.usdc --show show.toml --performer anna --character mia "
        "--handles 8 -o reel.json",
    ),
    "bind": (
        "usdface bind rig.usdc --take take.usdc -o bind.html",
        "usdface bind shot.usda -o bind.html",
    ),
    "view": (
        "usdface view shot.usdface.usda -o shot.html",
        "usdface view head.glb -o head.html --face-only",
    ),
    "export": (
        "usdface export shot.usdface.usda -o face.glb",
        "usdface export face.usda --clip smile -o face.usdz",
    ),
    "import": (
        "usdface import face.glb -o face.usda",
        "usdface import clips.glb --rig avatar.vrm -o avatar.usdc",
    ),
    "check": (
        "usdface check assets/*.glb --format json --strict",
        "usdface check shot.usdface.usda --facs --figure units.png",
    ),
    "formats": ("usdface formats", "usdface formats --format json"),
    "plugins": ("usdface plugins", "usdface plugins --format json"),
    "fuzzy explain": (
        "usdface fuzzy explain shot.usda --frame 72",
        "usdface fuzzy explain shot.usda --time 1.2 --figure why.png",
    ),
    "fuzzy neutral": (
        "usdface fuzzy neutral shot.usda",
        "usdface fuzzy neutral shot.usda --format json",
    ),
    "fuzzy convert": (
        "usdface fuzzy convert mine.fis -o mine.usda",
        "usdface fuzzy convert shot.usda -o rules.usda",
    ),
    "fuzzy paper": ("usdface fuzzy paper -o paper.fis", "usdface fuzzy paper -o paper.usda"),
    "fuzzy fit": (
        "usdface fuzzy fit --shot shot.usda --labels labels.csv -o mine.usda",
        "usdface fuzzy fit --rig rig.usdc --bind bind.json --expressions poses.json -o mine.usda",
    ),
    "bench": (
        "usdface bench papers",
        "usdface bench papers --images film/ --fps 30 --names names.csv --rig head.usdc "
        "--bind bind.json --reference curves.csv",
    ),
}
