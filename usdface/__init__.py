"""usdface: facial retargeting in open formats."""
