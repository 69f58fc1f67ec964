"""The anatomy of a face: regions, sides, antagonists, lip and lid contacts, FACS names."""
