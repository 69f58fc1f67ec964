"""A glTF player that shares nothing with the reader and the writer: the judge of every export."""
