"""Reader, writer and checks of glTF 2.0; types of pygltflib and OpenImageIO stay in here."""
