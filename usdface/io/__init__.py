"""Readers and writers of files; types of pxr, pygltflib, OpenImageIO, trimesh stay in here."""
