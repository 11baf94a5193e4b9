# Radii, spheres and gauges about centers, and slopes of planes: factors close to 1 that round up.
#
# radius: the computed |v - c|^2 is the sum of three squares, each of a rounded difference, with one
# rounding and at most two sums: by hand, because all are positive, |v - c|^2 times factors of d1 to
# d5. Its root rounds once, and once more with kRadiusRoundUp.
radius = sqrt((1 + d1) * (1 + d1) * (1 + d2) * (1 + d3) * (1 + d4)) * (1 + d5) * kRadiusRoundUp
  * (1 + d6);

# spheres: if |n|^2 of the computed difference of the centers, which has three more roundings,
# exceeds the square of the reach, rounded twice with the factor, then |n| exceeds the reach.
squares = (1 + d1) * kSphereSquareRoundUp * (1 + d2) / ((1 + d3) * (1 + d4) * (1 + d5));
# The reach covers radii of at most 4 S in total, with the rounding of their sums, and the error of
# the difference of the centers, sqrt(3) times kMinkowskiErrorFactor S, in units of S.
reach = (r * (1 + d1) + kSphereErrorFactor * (1 + d2)) * (1 + d3);
needed = r + 0x1.bb67bp0 * kMinkowskiErrorFactor;

# gauges: the computed (g_A g_B) factor < g_A + g_B implies the inequality without rounding.
gauges = (1 + d1) * kCenterProductRoundUp * (1 + d2) / (1 + d3);

# slopes: |e||f| rounds once, once more with the factor, and then to a float.
slopes = (1 + d1) * kPlaneSlopeRoundUp * (1 + d2) * (1 + to_float);

{ |d1| <= kUnitRoundoff /\ |d2| <= kUnitRoundoff /\ |d3| <= kUnitRoundoff /\ |d4| <= kUnitRoundoff
  /\ |d5| <= kUnitRoundoff /\ |d6| <= kUnitRoundoff /\ r in [0, 4]
  /\ |to_float| <= 1b-24
  -> radius >= 1 /\ squares >= 1 /\ reach - needed >= 0 /\ gauges >= 1 /\ slopes >= 1 }

reach - needed -> (r * (d1 + d3 + d1 * d3))
  + (kSphereErrorFactor * (1 + d2) * (1 + d3) - 0x1.bb67bp0 * kMinkowskiErrorFactor);

# Refused: kRadiusRoundUp = 0x1.0000000000002p0
# Refused: kSphereSquareRoundUp = 0x1.0000000000002p0
# Refused: kSphereErrorFactor * 0.85
# Refused: kCenterProductRoundUp = 0x1.0000000000001p0
# Refused: kPlaneSlopeRoundUp = 0x1.000001p0
