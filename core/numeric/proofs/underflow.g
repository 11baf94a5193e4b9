# The contribution of underflow to the determinants of orient2d.g and orient3d.g. A product that
# underflows errs by h, |h| <= 2^-1075; sums never do. With differences of at most D, and r = 1 / (D
# + 1): six inner products err by h each, times a difference and at most four roundings, g; three
# outer products by h, times at most two sums. The permanent may lose as much, which the factor,
# below 2^-50, makes small; its product with the factor, and that of size + 1 with kUnderflowError,
# may each lose h. All in units of D + 1, and of 2^-1075.
#
# If the differences were scaled to D < 1 by powers of two, each of nine components may also have
# lost h, times a minor, at most 2 D^2 <= 2 D, and at most four roundings.

spatial = (6 * (1 - r) * h1 * g + 3 * r * h2 * g) * (1 + 1b-50) + r * (h3 + h4);
scaled = spatial + 18 * (1 - r) * h5 * g;
planar = 2 * h1 * g + h3 + h4;
# size + 1 is the sum of ten terms: at least (D + 1) (1 - u)^10.
bound = kUnderflowError * 1b1075 * (1 - 1b-49);

{ r in [0, 1] /\ |h1| <= 1 /\ |h2| <= 1 /\ |h3| <= 1 /\ |h4| <= 1 /\ |h5| <= 1
  /\ g in [0, 0x1.00001p0]
  -> spatial / bound <= 1 /\ scaled / bound <= 1 /\ planar / bound <= 1 }

# Refused: kUnderflowError * 0.125
