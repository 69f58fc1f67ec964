"""Pictures of real takes at their peaks, raw over corrected: `python -m benchmarks.pictures`."""
