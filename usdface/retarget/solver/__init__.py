"""The least squares of a take: terms, bounds, and all frames at once or each alone."""
