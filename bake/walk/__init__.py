"""The walk: what a character moving through the regions would be lit by, and where it pops."""
