"""Many shots: their list, detection of outdated results, worker processes, the table of results."""
