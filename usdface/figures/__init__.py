"""Pictures for people (matplotlib, the extra `plot`)."""
