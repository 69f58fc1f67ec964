"""Files in and out: foreign types (pxr, pygltflib, OpenImageIO, trimesh) stop here."""
