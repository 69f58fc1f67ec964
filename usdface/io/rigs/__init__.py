"""Rigs in that are neither USD nor glTF: folders of meshes, MakeHuman."""
