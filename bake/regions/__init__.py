"""Dynamic regions: boxes, validity, spherical harmonics, models, regularisation (Sloan et al. 2013, section 2.3)."""
