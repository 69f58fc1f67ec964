"""Fitting a fuzzy system: from labelled examples, or as the fuzzy paper has it."""
