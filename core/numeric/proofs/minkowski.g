# A component of w = R_A a - (R_B b + (t_B - t_A)), in units of S = M_A + M_B + |t_B - t_A|, with
# parts P, (1 - P) Q and (1 - P) (1 - Q). The entries r of the rotations err by g. A point a or b
# may be a mean of vertices that errs by m in units of M: by 7 u for the center, the sum of six
# sixths, by 11 u for a mean of up to ten vertices (by hand: at most ten roundings of at most 10 M,
# divided by ten, and the division).

a1 = P * x1; a2 = P * x2; a3 = P * x3;
B = (1 - P) * Q;
b1 = B * y1; b2 = B * y2; b3 = B * y3;
t = (1 - P) * (1 - Q) * z;

r1 = R1 + g1; r2 = R2 + g2; r3 = R3 + g3;
q1 = Q1 + h1; q2 = Q2 + h2; q3 = Q3 + h3;
c1 = a1 + P * m1; c2 = a2 + P * m2; c3 = a3 + P * m3;
d1 = b1 + B * n1; d2 = b2 + B * n2; d3 = b3 + B * n3;

at_a = fl(r1 * c1 + r2 * c2 + r3 * c3);
turned_b = fl(q1 * d1 + q2 * d2 + q3 * d3);
offset = t * (1 + e);
at_b = fl(turned_b + offset);
w = fl(at_a - at_b);

exact_a = R1 * a1 + R2 * a2 + R3 * a3;
exact_b = Q1 * b1 + Q2 * b2 + Q3 * b3;
exact = exact_a - (exact_b + t);

{ P in [0, 1] /\ Q in [0, 1] /\ |z| <= 1 /\ |e| <= kUnitRoundoff
  /\ |x1| <= 1 /\ |x2| <= 1 /\ |x3| <= 1 /\ |y1| <= 1 /\ |y2| <= 1 /\ |y3| <= 1
  /\ |R1| <= 1 /\ |R2| <= 1 /\ |R3| <= 1 /\ |Q1| <= 1 /\ |Q2| <= 1 /\ |Q3| <= 1
  /\ |g1| <= kRotationEntryError /\ |g2| <= kRotationEntryError /\ |g3| <= kRotationEntryError
  /\ |h1| <= kRotationEntryError /\ |h2| <= kRotationEntryError /\ |h3| <= kRotationEntryError
  /\ |m1| <= 11b-53 /\ |m2| <= 11b-53 /\ |m3| <= 11b-53
  /\ |n1| <= 11b-53 /\ |n2| <= 11b-53 /\ |n3| <= 11b-53
  -> |w - exact| <= kMinkowskiErrorFactor }

at_a - exact_a -> (at_a - (r1 * c1 + r2 * c2 + r3 * c3))
  + (g1 * c1 + g2 * c2 + g3 * c3) + P * (R1 * m1 + R2 * m2 + R3 * m3);
turned_b - exact_b -> (turned_b - (q1 * d1 + q2 * d2 + q3 * d3))
  + (h1 * d1 + h2 * d2 + h3 * d3) + B * (Q1 * n1 + Q2 * n2 + Q3 * n3);
at_b - (exact_b + t) -> (at_b - (turned_b + offset)) + (turned_b - exact_b) + t * e;
w - exact -> (w - (at_a - at_b)) + (at_a - exact_a) - (at_b - (exact_b + t));
$ P in 8, Q in 4;

# Refused: kMinkowskiErrorFactor * 0.7
