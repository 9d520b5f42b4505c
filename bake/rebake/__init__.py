"""Rebaking what an edit can reach, and nothing else."""
