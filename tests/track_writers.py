"""Writers of 2D tracks in the formats of other programs, and the tracks that they write.

Places are in pixels from the outer corner of the top left pixel of the image, y down; frame 0 is
the first image. Each writer turns them into its program's numbers.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

__all__ = ["SIZE", "TRACKS", "WRITERS", "Tracks", "Writer", "expected_positions"]

Tracks = dict[str, dict[int, tuple[float, float]]]

SIZE = WIDTH, HEIGHT = 1920, 1080
# A name with a blank, places beside the pixels' centres and outside the image, a gap, and a track
# that was never seen.
TRACKS: Tracks = {
    "left brow": {f: (100.5 + 7.25 * f, 300.25 - 5.5 * f) for f in range(8)} | {2: (-3.25, -1.5)},
    "chin": {f: (960.0 + f, 1079.5 - 2 * f) for f in (0, 1, 2, 5, 6, 7)},
    "lost": {},
}


@dataclass(frozen=True)
class Writer:
    """A format: how a file is called and written, and what it cannot say."""

    file: str
    write: Callable[[Tracks], str]
    options: dict[str, object] = field(default_factory=dict)
    keeps_empty_tracks: bool = True
    names: Callable[[str], str] = str
    tolerance: float = 1e-4


def expected_positions(tracks: Tracks) -> np.ndarray:
    """Positions (F, M, 2) of a take, y up, of the tracks with samples."""
    seen = [track for track in tracks.values() if track]
    frames = sorted({frame for track in seen for frame in track})
    nowhere = (np.nan, np.nan)
    places = [[track.get(frame, nowhere) for track in seen] for frame in frames]
    return np.array(places) * [1.0, -1.0]


def write_3de4(tracks: Tracks) -> str:
    lines = [str(len(tracks))]
    for name, track in tracks.items():
        lines += [name, "0", str(len(track))]
        lines += [f"{f + 1} {x:.15f} {HEIGHT - y:.15f}" for f, (x, y) in track.items()]
    return "\n".join(lines) + "\n"


def write_3de3(tracks: Tracks) -> str:
    lines = [f"// 3DE Multiple Tracking Curves Export {WIDTH} x {HEIGHT} * 8 frames"]
    for name, track in tracks.items():
        lines.append(name)
        lines += [f"\t{f + 1}\t{x:.4f}\t{HEIGHT - y:.4f}" for f, (x, y) in track.items()]
    return "\n".join(lines) + "\n"


def write_pftrack(tracks: Tracks, camera: str = '"Primary"\n', first: int = 0) -> str:
    text = "# 2D feature tracks\n#\n"
    for name, track in tracks.items():
        text += f'\n"{name}"\n{camera}{len(track)}\n'
        for f, (x, y) in track.items():
            text += f"{f + first} {x - 0.5:.4f} {HEIGHT - y - 0.5:.4f} 0.010\n"
    return text


def write_shake(tracks: Tracks, correlation: float = 0.9) -> str:
    text = ""
    for name, track in tracks.items():
        text += f"TrackName {name}\n   Frame             X             Y   Correlation\n"
        for f, (x, y) in track.items():
            text += f"   {f + 1:.2f}   {x:.4f}   {HEIGHT - y:.4f}   {correlation:.3f}\n"
        text += "\n"
    return text


def write_syntheyes(tracks: Tracks, status: str = " 7") -> str:
    return "".join(
        f"{name} {f} {_centred(x, WIDTH):.9f} {_centred(y, HEIGHT):.9f}{status}\n"
        for name, track in tracks.items()
        for f, (x, y) in track.items()
    )


def _centred(place: float, side: int) -> float:
    return ((place - 0.5) / (side - 1) - 0.5) * 2


def write_boujou(tracks: Tracks) -> str:
    text = "# boujou 2d tracks export: text\n# boujou version: 4.1.0\n# \n# track_id  view  x  y\n"
    for name, track in tracks.items():
        text += "".join(f"{name}  {f}  {x:.4f}  {y:.4f}\n" for f, (x, y) in track.items())
    return text


def write_matchmover(tracks: Tracks, fit: float = 0.95) -> str:
    text = f'imageSequence\t"Sequence 01"\n{{\n\t{WIDTH}\t{HEIGHT}\tf( "D:/a.%04d.dpx" )\t'
    text += "b( 1 8 1 )\t\n}\n"
    for name, track in tracks.items():
        text += f'pointTrack  "{name}"  rgb( 255 0 0 )\t\n{{\n'
        for n, (f, (x, y)) in enumerate(track.items()):
            how = f"p+( {fit:.3f} )\t" if n else "ki( 0.8 )\t    s( 66 66 64 64 )  p( 24 24 25 25 )"
            text += f"\t{f + 1}\t   {x:.4f}     {y:.4f}    {how}\n"
        text += "}\n"
    return text


def write_maya_live(tracks: Tracks) -> str:
    text = f"#  Size  {WIDTH}  {HEIGHT}  {WIDTH / HEIGHT:.2f}\n"
    for n, (name, track) in enumerate(tracks.items()):
        text += f"#  Name {name}\n"
        for f, (x, y) in track.items():
            u, v = (2 * x - WIDTH) / HEIGHT, 1 - 2 * y / HEIGHT
            text += f"{n} {f} {u:.10f} {v:.10f} 0.001\n"
    return text


def write_maya_pixels(tracks: Tracks) -> str:
    text = f"# Size {WIDTH} {HEIGHT}\n# Pixels\n"
    for n, (name, track) in enumerate(tracks.items()):
        text += f"# Name {name}\n"
        text += "".join(f"{n} {f} {x:.4f} {HEIGHT - y:.4f} 0\n" for f, (x, y) in track.items())
    return text


def _curves(track: dict[int, tuple[float, float]]) -> str:
    """A curve of x and one of y; after a gap the step is given twice, as Nuke does."""
    curves = []
    for axis in (0, 1):
        words, last, after_gap = [], None, False
        for f, place in track.items():
            if last is None or f != last + 1 or after_gap:
                words.append(f"x{f + 1}")
            after_gap = last is not None and f != last + 1
            words.append(f"{place[0] if axis == 0 else HEIGHT - place[1]:.4f}")
            last = f
        curves.append("{curve i " + " ".join(words) + "}")
    return " ".join(curves)


def write_tracker3(tracks: Tracks) -> str:
    text = (
        "#! /usr/local/Nuke -nx\nversion 5.1200\n"
        f'Root {{\n inputs 0\n fps 25\n format "{WIDTH} {HEIGHT} 0 0 {WIDTH} {HEIGHT} 1 HD"\n}}\n'
    )
    for name, track in tracks.items():
        if track:
            name = name.replace(" ", "_")
            text += (
                f"Tracker3 {{\n track1 {{{_curves(track)}}}\n track2 {{9 9}}\n name {name}\n}}\n"
            )
    return text


def write_tracker4(tracks: Tracks) -> str:
    header = "{ 5 1 20 enable e 1 }\n{ 3 1 75 name name 1 }\n"
    header += "".join(f"{{ 2 1 58 {n} {n} 1 }}\n" for n in ("track_x", "track_y", "error"))
    rows = ""
    for name, track in tracks.items():
        curves = _curves(track) if track else "{} {}"
        rows += f' {{ {{curve K x1 1}} "{name}" {curves} {{}} }}\n'
    return (
        "set cut_paste_input [stack 0]\nversion 8.0 v1\npush $cut_paste_input\n"
        f"Tracker4 {{\ntracks {{ {{ 1 5 {len(tracks)} }}\n{{ {header}}}\n{{\n{rows}}}\n}}\n"
        'name "Tracker1"\nlabel "\\{ [value x] }"\n}\n'
    )


def write_after_effects(tracks: Tracks) -> str:
    text = "Adobe After Effects 8.0 Keyframe Data\n\n\tUnits Per Second\t25\n"
    text += f"\tSource Width\t{WIDTH}\n\tSource Height\t{HEIGHT}\n"
    text += "\tSource Pixel Aspect Ratio\t1\n\tComp Pixel Aspect Ratio\t1\n"
    for name, track in tracks.items():
        text += f"\nEffects\t{name}\tPoint\n\tFrame\tX pixels\tY pixels\n"
        text += "".join(f"\t{f}\t{x:.4f}\t{y:.4f}\n" for f, (x, y) in track.items())
    text += "\nTransform\tScale\n\tFrame\tX percent\tY percent\tZ percent\n\t0\t100\t100\t100\n"
    return text + "\n\nEnd of Keyframe Data\n"


def write_uv1(tracks: Tracks) -> str:
    lines = [str(len(tracks))]
    for name, track in tracks.items():
        lines += [name, str(len(track))]
        lines += [
            f"{f + 1} {x / WIDTH:.9f} {1 - y / HEIGHT:.9f} 1.0" for f, (x, y) in track.items()
        ]
    return "\n".join(lines) + "\n"


def write_uv4(tracks: Tracks, version: int = 4) -> str:
    points = [
        {
            "name": name,
            "id": n,
            "set_name": "ObjectTrack",
            "per_frame": [
                {
                    "frame": f + 1,
                    "pos": [x / WIDTH, 1 - y / HEIGHT],
                    "pos_dist": [0.0, 0.0],
                    "weight": 1.0,
                }
                for f, (x, y) in track.items()
            ],
        }
        for n, (name, track) in enumerate(tracks.items())
    ]
    document = {"version": version, "num_points": len(points), "points": points}
    return json.dumps(document | {"camera": {"resolution": list(SIZE)}}, indent=1)


def _of_frame(tracks: Tracks, frame: int) -> list[tuple[float, float] | None]:
    return [track.get(frame) for track in tracks.values()]


def _frames(tracks: Tracks) -> range:
    return range(1 + max(frame for track in tracks.values() for frame in track))


def write_deeplabcut(tracks: Tracks) -> str:
    names = [name for name in tracks for _ in range(3)]
    rows = [["scorer", *["net"] * len(names)], ["bodyparts", *names]]
    rows.append(["coords", *["x", "y", "likelihood"] * len(tracks)])
    for f in _frames(tracks):
        cells = [
            f"{p[0] - 0.5},{p[1] - 0.5},0.99" if p else "7,7,0.01" for p in _of_frame(tracks, f)
        ]
        rows.append([str(f), *cells])
    return "\n".join(",".join(row) for row in rows) + "\n"


def write_sleap(tracks: Tracks) -> str:
    columns = [f"{name}.{kind}" for name in tracks for kind in ("x", "y", "score")]
    rows = [["track", "frame_idx", "instance.score", *columns]]
    for f in _frames(tracks):
        cells = [f"{p[0] - 0.5},{p[1] - 0.5},0.9" if p else ",," for p in _of_frame(tracks, f)]
        rows.append(["", str(f), "0.8", *cells])
    return "\n".join(",".join(row) for row in rows) + "\n"


def write_openface(tracks: Tracks) -> str:
    count = len(tracks)
    names = ["frame", "face_id", "timestamp", "confidence", "success", "pose_Tx"]
    names += [f"{axis}_{n}" for axis in "xyXYZ" for n in range(count)]
    rows = [", ".join(names)]
    for f in _frames(tracks):
        places = [p or (np.nan, np.nan) for p in _of_frame(tracks, f)]
        xs, ys = ([str(p[axis] - 0.5) for p in places] for axis in (0, 1))
        rows.append(", ".join([f"{f + 1},0,{f / 25:.3f},0.98,1,3.5", *xs, *ys, *["0"] * 3 * count]))
    return "\n".join(rows) + "\n"


def write_mediapipe_json(tracks: Tracks) -> str:
    frames = [
        {
            "frame": f,
            "timestamp_ms": 40 * f,
            "face_landmarks": [
                [
                    {"x": p[0] / WIDTH, "y": p[1] / HEIGHT, "z": 0.1}
                    if p
                    else {"x": None, "y": None}
                    for p in _of_frame(tracks, f)
                ]
            ],
        }
        for f in _frames(tracks)
    ]
    return json.dumps({"width": WIDTH, "height": HEIGHT, "frames": frames})


def write_mediapipe_csv(tracks: Tracks) -> str:
    rows = ["frame,landmark_index,x,y,z"]
    rows += [
        f"{f},{n},{x / WIDTH:.9f},{y / HEIGHT:.9f},0.1"
        for n, track in enumerate(tracks.values())
        for f, (x, y) in track.items()
    ]
    return "\n".join(rows) + "\n"


def _numbered(name: str) -> str:
    return f"landmark_{list(TRACKS).index(name)}"


_RATE: dict[str, object] = {"rate": 25.0}
_SIZED = _RATE | {"image_size": SIZE}

WRITERS = {
    "3de4": Writer("a.txt", write_3de4, _SIZED),
    "3de3": Writer("a.txt", write_3de3, _RATE),
    "pftrack 5": Writer("a.2dt", write_pftrack, _SIZED),
    "pftrack 4": Writer("a.2dt", lambda t: write_pftrack(t, "", 0), _SIZED),
    "pfmatchit": Writer("a.txt", lambda t: write_pftrack(t, "1\n", 1), _SIZED),
    "shake": Writer("a.txt", write_shake, _SIZED),
    "syntheyes": Writer("a.txt", write_syntheyes, _SIZED, False),
    "syntheyes without codes": Writer("a.txt", lambda t: write_syntheyes(t, ""), _SIZED, False),
    "boujou": Writer("a.txt", write_boujou, _RATE, False),
    "matchmover": Writer("a.rz2", write_matchmover, _RATE),
    "maya live": Writer("a.txt", write_maya_live, _RATE),
    "maya live, pixels": Writer("a.txt", write_maya_pixels, _RATE),
    "tracker3": Writer("a.nk", write_tracker3, {}, False, lambda n: n.replace(" ", "_")),
    "tracker4": Writer("a.nk", write_tracker4, _SIZED, False),
    "after effects": Writer("a.txt", write_after_effects, {}, False),
    "mmsolver 1": Writer("a.uv", write_uv1, _SIZED),
    "mmsolver 4": Writer("a.uv", write_uv4, _RATE),
    "deeplabcut": Writer("a.csv", write_deeplabcut, _RATE),
    "sleap": Writer("a.csv", write_sleap, _RATE),
    "openface": Writer("a.csv", write_openface, {}, names=_numbered),
    "mediapipe json": Writer("a.json", write_mediapipe_json, {}, names=_numbered),
    "mediapipe csv": Writer("a.csv", write_mediapipe_csv, _SIZED, False, _numbered),
}
