"""The page: everything of a run in one file that needs nothing else."""
