"""The sample level and the scripts that make it: `python -m assets.sample_level.build`."""
