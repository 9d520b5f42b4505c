"""Device functions and kernels, nothing else. Importing a module here loads Warp."""
