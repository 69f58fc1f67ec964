"""Many shots: their list, what is out of date, worker processes, the table of results."""
