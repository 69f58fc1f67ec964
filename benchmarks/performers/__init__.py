"""Other people's performances: takes of performers whose weights are known."""
