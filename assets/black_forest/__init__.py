"""What the objects of SuperTuxKart's Black Forest are to the bake."""
