"""Points and poses: numpy in, numpy out."""
