"""The output of each command, for its help: the file that it writes, the figures that it prints."""

from textwrap import fill

__all__ = ["OUTCOMES", "describe"]

OUTCOMES: dict[str, str] = {
    "rig": "Writes the character as USD: meshes, blend shapes, skeleton, materials. Prints their "
    "numbers.",
    "take": "Writes the take as USD. Prints its frames, rate, markers and the share that is "
    "occluded.",
    "markers": "Prints a vertex for each marker, the most informative first, and how many blend "
    "shapes are still undetermined with it. -o writes them as a binding.",
    "shot": "Writes a shot, which references rig and take and holds binding, expression poses and "
    "fuzzy system. Prints their numbers.",
    "calibrate": "Writes the calibration of the performer: gains and directions of the movements, "
    "and the resting face. Prints the gains.",
    "process": "Writes layers over the shot, which stays as it is: the solve, the correction, the "
    "completed closures; and a root layer that joins them, the file to open. Prints the error of "
    "the solve, its least certain blend shapes, the peaks of the emotions, and at the end a "
    "verdict with remedies.",
    "sequence": "Writes the result of each shot that is out of date. Prints a table of all shots, "
    "the worst first: verdict, error, occlusion, correction, findings.",
    "conform": "Writes a show file for `usdface sequence`. Prints the numbers of clips and shots.",
    "bind": "Writes the page, with rig and take in it. Prints the numbers of markers that are "
    "bound and unsure.",
    "view": "Writes the page, with meshes, animation and errors in it. Prints its size.",
    "export": "Writes the scene. Prints its numbers and the certificate: the largest differences "
    "of vertices, normals, weights and times between the scene and the glTF, read back.",
    "import": "Writes the scene. Prints its numbers and the certificate: the largest differences "
    "of vertices, normals, weights and times between the glTF and the USD, read back.",
    "check": "Writes nothing. Prints the faults as findings, and with --facs the action unit that "
    "each blend shape shows, with a verdict. The exit status is 1 where a fault is an error.",
    "formats": "Prints each format with its file name suffixes and the package it comes from.",
    "plugins": "Prints each plug-in, whether it would load, and the package it comes from.",
    "fuzzy explain": "Prints the emotions of a frame, the rules that fire with the membership of "
    "each condition, and the weights before and after the correction.",
    "fuzzy neutral": "Prints the emotions of a neutral face, at rest and with 0.3 mm of marker "
    "noise, and the rules that fire; beside them those of the paper's system.",
    "fuzzy convert": "Writes the system. Prints its numbers of inputs, outputs, terms and rules, "
    "and as findings whatever the other format cannot express.",
    "fuzzy paper": "Writes the system. Prints its numbers of inputs, outputs, terms and rules.",
    "fuzzy fit": "Writes the system. Prints its rules, the confusion matrix of a cross-validation "
    "with --labels, and the motions that separate emotions.",
    "bench": "Prints each published figure beside the computed one, and the largest difference. "
    "The exit status is 1 where one is larger than promised.",
}
_ENDS = "The last lines are the findings and the files that were written."
_WIDTH = 79  # of a terminal of 80 columns, as argparse fills the rest of the help


def describe(command: str, summary: str) -> str:
    """Return the description of a command for its help: its summary, then its output."""
    return f"{summary}\n\n{fill(f'{OUTCOMES[command]} {_ENDS}', _WIDTH)}"
