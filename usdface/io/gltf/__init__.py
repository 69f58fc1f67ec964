"""glTF in and out: pygltflib and OpenImageIO stop here."""
