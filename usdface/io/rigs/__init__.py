"""Readers of rigs: folders of meshes, MakeHuman; glTF and USD without animations."""
