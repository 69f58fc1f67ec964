"""Independent glTF player, which shares no code with reader and writer, to certify exports."""
