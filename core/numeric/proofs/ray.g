# The ray's direction times a computed Minkowski vertex, in units of the largest component W; both
# err by D = d / W per component, D >= 32 u because W <= 4 S.
#
# By hand: the computed product is at most slightly above 3, so it exceeds F D only if D is below 3
# / 8 and slightly more.

value = fl(p1 * q1 + p2 * q2 + p3 * q3);
at_computed = p1 * q1 + p2 * q2 + p3 * q3;
P1 = p1 - D * x1; P2 = p2 - D * x2; P3 = p3 - D * x3;
Q1 = q1 - D * y1; Q2 = q2 - D * y2; Q3 = q3 - D * y3;
exact = P1 * Q1 + P2 * Q2 + P3 * Q3;
change = (x1 * q1 + x2 * q2 + x3 * q3) + (P1 * y1 + P2 * y2 + P3 * y3);

{ |p1| <= 1 /\ |p2| <= 1 /\ |p3| <= 1 /\ |q1| <= 1 /\ |q2| <= 1 /\ |q3| <= 1
  /\ |x1| <= 1 /\ |x2| <= 1 /\ |x3| <= 1 /\ |y1| <= 1 /\ |y2| <= 1 /\ |y3| <= 1
  /\ D in [32b-53, 0x0.60001p0]
  -> |(value - exact) / D| <= kRayErrorFactor }

(value - exact) / D -> (value - at_computed) / D + change { D <> 0 };

# Refused: kRayErrorFactor * 0.8
