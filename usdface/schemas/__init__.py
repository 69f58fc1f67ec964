"""The USD schemas of usdface: codeless typed prims (see docs/usd.md)."""
