"""USD stages and layers in and out: pxr stops here."""
