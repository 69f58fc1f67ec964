"""Files in and out: foreign types (pxr, pygltflib, OpenImageIO, trimesh, ezc3d) stop here."""
