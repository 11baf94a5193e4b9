# The largest value over a small pair (small_pair.h), with its vertices rotated in advance. In units
# of |n| = 1 and S = 1, P is the part of A, 1 - P that of B and of the translation. A rotated
# vertex, `position`, errs by at most 65 u of its part per component: its value s by 195 u and the
# rounding of the product. X is s with its vertex number in the four low bits: fifteen units in the
# last place, below 2^-48 of itself. `fresh` is the value recomputed from the vertices found.
#
# By hand: positions are at most sqrt(3), values n . y at most 3 (Cauchy and Schwarz). The vertex
# found has an X of at least that of the farthest. The exact maximum therefore exceeds `fresh` by at
# most the excess of the farthest vertex's exact value over its X, `below`, plus the excess of the X
# of the one found over `fresh`, `again`. In the other direction fresh errs by less.

# The part of M is Q, that of the translation 1 - Q, 0 for A.
x1 = Q * y1; x2 = Q * y2; x3 = Q * y3;
t = (1 - Q) * y4;
s1 = R1 + g1; s2 = R2 + g2; s3 = R3 + g3;
turned = fl(s1 * x1 + s2 * x2 + s3 * x3);
exact_turned = R1 * x1 + R2 * x2 + R3 * x3;
position = fl(turned + t * (1 + e));

dot = fl(n1 * p1 + n2 * p2 + n3 * p3);
exact_dot = n1 * p1 + n2 * p2 + n3 * p3;
d1 = fl(p1 + q1); d2 = fl(p2 + q2); d3 = fl(p3 + q3);
fresh_dot = fl(n1 * d1 + n2 * d2 + n3 * d3);
exact_fresh = n1 * (p1 + q1) + n2 * (p2 + q2) + n3 * (p3 + q3);

B = 1 - P;
below = -(P * ((195b-53 * z1 + r1) * (1 + k1) + v * k1))
  - B * ((195b-53 * z2 + r2) * (1 + k2) + w * k2);
again = P * (a * k3 + r3 * (1 + k3)) + B * (b * k4 + r4 * (1 + k4)) - r5;

{ P in [0, 1] /\ |n1| <= 1 /\ |n2| <= 1 /\ |n3| <= 1
  /\ |p1| <= 0x1.bb68p0 /\ |p2| <= 0x1.bb68p0 /\ |p3| <= 0x1.bb68p0
  /\ |p1 + q1| <= 0x1.bb68p0 /\ |p2 + q2| <= 0x1.bb68p0 /\ |p3 + q3| <= 0x1.bb68p0
  /\ |v| <= 3 /\ |w| <= 3 /\ |a| <= 0x3.0001p0 /\ |b| <= 0x3.0001p0 /\ |z1| <= 1 /\ |z2| <= 1
  /\ |r1| <= 14b-53 /\ |r2| <= 14b-53 /\ |r3| <= 14b-53 /\ |r4| <= 14b-53 /\ |r5| <= 20b-53
  /\ |k1| <= 1b-48 /\ |k2| <= 1b-48 /\ |k3| <= 1b-48 /\ |k4| <= 1b-48
  /\ Q in [0, 1] /\ |y1| <= 1 /\ |y2| <= 1 /\ |y3| <= 1 /\ |y4| <= 1 /\ |e| <= kUnitRoundoff
  /\ |R1| <= 1 /\ |R2| <= 1 /\ |R3| <= 1 /\ |g1| <= kRotationEntryError
  /\ |g2| <= kRotationEntryError /\ |g3| <= kRotationEntryError
  -> |position - (exact_turned + t)| <= 65b-53 /\ |dot - exact_dot| <= 14b-53 /\ |fresh_dot - exact_fresh| <= 20b-53
  /\ |below + again| <= kSupportErrorFactor }
turned - exact_turned -> (turned - (s1 * x1 + s2 * x2 + s3 * x3)) + (g1 * x1 + g2 * x2 + g3 * x3);
position - (exact_turned + t) -> (position - (turned + t * (1 + e))) + (turned - exact_turned)
  + t * e;
$ P in 8, Q in 16;

# Refused: kSupportErrorFactor * 0.75
