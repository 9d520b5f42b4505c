"""Trees, shrubs, small decorators and lower LODs: everything besides opaque surfaces."""
