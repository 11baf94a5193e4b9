# det[p, q, r] with each column a computed Minkowski vertex, the difference of two, or the ray, in
# units of the largest component W. A vertex errs by at most d = kMinkowskiErrorFactor S, a
# difference by 2 d and its rounding, at most u W <= d / 16, because W <= 8 S: the exact component
# is p - D x, D = d / W, |x| <= 2.1.
#
# By hand: as in determinant.g, the computed one exceeds F D only if D is below 4 / 64 and slightly
# more.

value = fl(p1 * (q2 * r3 - q3 * r2) + p2 * (q3 * r1 - q1 * r3) + p3 * (q1 * r2 - q2 * r1));
at_computed = p1 * (q2 * r3 - q3 * r2) + p2 * (q3 * r1 - q1 * r3) + p3 * (q1 * r2 - q2 * r1);
P1 = p1 - D * x1; P2 = p2 - D * x2; P3 = p3 - D * x3;
Q1 = q1 - D * y1; Q2 = q2 - D * y2; Q3 = q3 - D * y3;
R1 = r1 - D * z1; R2 = r2 - D * z2; R3 = r3 - D * z3;
exact = P1 * (Q2 * R3 - Q3 * R2) + P2 * (Q3 * R1 - Q1 * R3) + P3 * (Q1 * R2 - Q2 * R1);
# (at_computed - exact) / D, column by column.
change = (x1 * (q2 * r3 - q3 * r2) + x2 * (q3 * r1 - q1 * r3) + x3 * (q1 * r2 - q2 * r1))
  + (P1 * (y2 * r3 - y3 * r2) + P2 * (y3 * r1 - y1 * r3) + P3 * (y1 * r2 - y2 * r1))
  + (P1 * (Q2 * z3 - Q3 * z2) + P2 * (Q3 * z1 - Q1 * z3) + P3 * (Q1 * z2 - Q2 * z1));

{ |p1| <= 1 /\ |p2| <= 1 /\ |p3| <= 1 /\ |q1| <= 1 /\ |q2| <= 1 /\ |q3| <= 1
  /\ |r1| <= 1 /\ |r2| <= 1 /\ |r3| <= 1 /\ |x1| <= 2.1 /\ |x2| <= 2.1 /\ |x3| <= 2.1
  /\ |y1| <= 2.1 /\ |y2| <= 2.1 /\ |y3| <= 2.1 /\ |z1| <= 2.1 /\ |z2| <= 2.1 /\ |z3| <= 2.1
  /\ D in [16b-53, 0x0.1000001p0]
  -> |(value - exact) / D| <= kDifferencesErrorFactor }

(value - exact) / D -> (value - at_computed) / D + change { D <> 0 };

# Refused: kDifferencesErrorFactor * 0.6
