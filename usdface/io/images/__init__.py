"""Images and image sequences, read by OpenImageIO."""
