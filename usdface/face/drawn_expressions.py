"""Drawn expressions: how people and artists show the six emotions, in action units.

FACS lists the prototypes of emotions; few people show all units of one, and artists draw other
ones: joy with raised brows and a wrinkled nose, fear without stretched lips, sadness with narrowed
lids. Numbers are strengths; a unit that one half alone shows has half of it.

* `rafd`: O. Langner et al., "Presentation and validation of the Radboud Faces Database", Cognition
  and Emotion 24, 2010: the units that models were asked for; strengths are ours.
* `compound`: S. Du, Y. Tao, A. Martinez, "Compound facial expressions of emotion", PNAS 111, 2014:
  units that most people show, the stronger the more people do.
* `makehuman`: ten expressions of the MakeHuman team (CC0), poses of joints, by the units that their
  joints move; those that `benchmarks/expression_takes.py` judges by are not among them.
* `unit_poses`: six expressions of a MakeHuman fork (SeedeXR), which name their units.
* `talkinghead`: faces of TalkingHead (M. Suominen, github.com/met4citizen/TalkingHead), ARKit's
  blend shapes as units.
* `virtual_friend`: faces of r3f-virtual-girlfriend-frontend (Wawa Sensei, github.com/wass08),
  likewise.
"""

__all__ = ["DRAWN"]

DRAWN: dict[str, tuple[tuple[str, dict[int, float]], ...]] = {
    "rafd": (
        ("anger", {4: 0.9, 5: 0.7, 7: 0.7, 23: 0.8, 24: 0.6}),
        ("anger", {4: 0.9, 5: 0.7, 7: 0.7, 10: 0.6, 17: 0.4, 23: 0.6, 25: 0.8}),
        ("disgust", {9: 0.8, 10: 0.8, 25: 0.7, 26: 0.3}),
        ("fear", {1: 0.8, 2: 0.8, 4: 0.5, 5: 0.8, 20: 0.8, 25: 0.8}),
        ("joy", {6: 0.8, 12: 0.8, 25: 0.8}),
        ("sadness", {1: 0.8, 4: 0.6, 15: 0.8, 17: 0.7}),
        ("surprise", {1: 0.9, 2: 0.9, 5: 0.8, 26: 0.6}),
    ),
    "compound": (
        ("joy", {6: 0.5, 12: 0.8, 25: 0.8}),
        ("sadness", {1: 0.6, 4: 0.8, 6: 0.4, 11: 0.3, 15: 0.8, 17: 0.6}),
        ("fear", {1: 0.8, 2: 0.5, 4: 0.8, 5: 0.7, 20: 0.8, 25: 0.8, 26: 0.4}),
        ("anger", {4: 0.8, 7: 0.8, 10: 0.3, 17: 0.5, 23: 0.3, 24: 0.8}),
        ("surprise", {1: 0.8, 2: 0.8, 5: 0.6, 25: 0.8, 26: 0.7}),
        ("disgust", {4: 0.3, 9: 0.8, 10: 0.8, 17: 0.8, 24: 0.3}),
    ),
    "makehuman": (
        ("fear", {2: 0.6, 5: 1.0, 20: 0.09, 27: 0.99}),
        ("fear", {1: 0.32, 2: 0.6, 5: 1.0, 16: 0.17, 20: 0.31}),
        ("fear", {1: 0.58, 2: 0.34, 5: 1, 16: 0.17, 20: 0.31, 27: 1}),
        ("sadness", {1: 0.55, 15: 0.51, 17: 0.21}),
        ("joy", {1: 0.34, 6: 0.53, 7: 0.43, 12: 0.82, 27: 0.78, 28: 0.11}),
        ("joy", {12: 0.35, 20: 0.16, 28: 0.27}),
        ("joy", {4: 0.08, 6: 0.38, 7: 0.46, 12: 0.83, 28: 0.15, 43: 0.09}),
        ("joy", {6: 0.75, 7: 0.23, 12: 0.66, 16: 0.18, 28: 0.24}),
        ("surprise", {1: 0.36, 5: 0.38, 12: 0.56, 18: 0.35, 27: 0.63}),
        ("anger", {4: 0.33, 7: 0.78, 9: 0.26, 10: 0.51, 43: 0.22}),
    ),
    "unit_poses": (
        ("fear", {1: 0.9, 2: 0.7, 4: 0.7, 5: 1, 7: 0.4, 20: 0.8, 26: 0.5}),
        ("anger", {4: 1, 5: 0.6, 7: 0.8, 28: 0.9}),
        ("disgust", {9: 1, 15: 0.6, 16: 0.7}),
        ("joy", {6: 0.7, 12: 1}),
        ("sadness", {1: 0.8, 4: 0.6, 15: 0.9}),
        ("surprise", {1: 0.9, 2: 0.9, 5: 0.8, 26: 0.7}),
    ),
    "talkinghead": (
        ("joy", {1: 0.6, 7: 1, 9: 0.7, 12: 0.7}),
        ("joy", {1: 0.6, 9: 0.4, 10: 0.3, 12: 0.7, 14: 0.2, 24: 0.3, 26: 0.25, 28: 0.4}),
        ("joy", {1: 0.6, 5: 0.7, 9: 0.4, 10: 0.3, 12: 0.7, 14: 0.2, 24: 0.3, 26: 0.25, 28: 0.4}),
        ("joy", {1: 0.3, 7: 1, 9: 0.4, 10: 0.3, 12: 0.7, 14: 0.2, 24: 0.3, 26: 0.35, 28: 0.4}),
        ("joy", {1: 0.3, 7: 1, 9: 0.4, 10: 0.3, 12: 0.7, 14: 0.2, 24: 0.5, 26: 0.3}),
        ("joy", {1: 0.3, 7: 1, 9: 0.4, 10: 0.3, 12: 0.7, 14: 0.2, 24: 0.5, 26: 0.3, 43: 0.6}),
        ("sadness", {1: 1, 7: 1, 10: 0.6, 15: 1, 18: 0.5, 26: 0.25, 43: 0.1}),
        ("sadness", {1: 1, 7: 1, 10: 0.8, 15: 1, 18: 1, 24: 0.4, 28: 0.6, 43: 0.5}),
        ("sadness", {1: 0.7, 7: 1, 10: 0.8, 15: 1, 17: 0.2, 18: 1, 28: 1, 43: 0.5}),
        ("sadness", {15: 1, 18: 0.1, 28: 0.8}),
        ("anger", {4: 1, 15: 1, 29: 0.3}),
        ("fear", {1: 0.8, 5: 0.5, 22: 0.5, 26: 0.7}),
    ),
    "virtual_friend": (
        ("sadness", {1: 0.45, 7: 0.73, 15: 1, 17: 0.78, 29: 1}),
        ("surprise", {1: 1, 5: 0.5, 22: 1, 26: 0.35}),
        ("anger", {4: 1, 6: 1, 7: 1, 9: 1, 14: 1, 17: 1, 22: 0.63, 29: 1}),
    ),
}
