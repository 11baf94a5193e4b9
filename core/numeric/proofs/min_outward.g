# The sign of det[p, q, r] = p . ((q - p) x (r - p)) for computed Minkowski vertices in a unit with
# S < 2. By hand: positions are at most sqrt(3) S, edges, in which translations cancel, at most 2
# sqrt(3) S; 3.465 and 6.93 cover these and their errors. A vertex errs by at most
# kMinkowskiErrorFactor S = 256 u, so an edge by twice that and its rounding.

E1 = e1 + 520b-53 * x1; E2 = e2 + 520b-53 * x2; E3 = e3 + 520b-53 * x3;
F1 = f1 + 520b-53 * y1; F2 = f2 + 520b-53 * y2; F3 = f3 + 520b-53 * y3;
P1 = p1 + 256b-53 * z1; P2 = p2 + 256b-53 * z2; P3 = p3 + 256b-53 * z3;
n1 = fl(e2 * f3 - e3 * f2); n2 = fl(e3 * f1 - e1 * f3); n3 = fl(e1 * f2 - e2 * f1);
M1 = e2 * f3 - e3 * f2; M2 = e3 * f1 - e1 * f3; M3 = e1 * f2 - e2 * f1;
N1 = E2 * F3 - E3 * F2; N2 = E3 * F1 - E1 * F3; N3 = E1 * F2 - E2 * F1;
exact = P1 * N1 + P2 * N2 + P3 * N3;
# The compared value is length times the least n . p / length over the corners: the rounding of the
# length cancels up to 10 u, by hand.
value = fl(p1 * n1 + p2 * n2 + p3 * n3);
compared = value * (1 + c);

{ |e1| <= 6.93 /\ |e2| <= 6.93 /\ |e3| <= 6.93 /\ |f1| <= 6.93 /\ |f2| <= 6.93 /\ |f3| <= 6.93
  /\ |p1| <= 3.465 /\ |p2| <= 3.465 /\ |p3| <= 3.465 /\ |c| <= 10b-53
  /\ |x1| <= 1 /\ |x2| <= 1 /\ |x3| <= 1 /\ |y1| <= 1 /\ |y2| <= 1 /\ |y3| <= 1
  /\ |z1| <= 1 /\ |z2| <= 1 /\ |z3| <= 1
  -> |compared - exact| <= kMinOutward }

n1 - N1 -> (n1 - M1) + (M1 - N1);
n2 - N2 -> (n2 - M2) + (M2 - N2);
n3 - N3 -> (n3 - M3) + (M3 - N3);
M1 - N1 -> -(520b-53 * (x2 * f3 + y3 * E2 - x3 * f2 - y2 * E3));
M2 - N2 -> -(520b-53 * (x3 * f1 + y1 * E3 - x1 * f3 - y3 * E1));
M3 - N3 -> -(520b-53 * (x1 * f2 + y2 * E1 - x2 * f1 - y1 * E2));
value - exact -> (value - (p1 * n1 + p2 * n2 + p3 * n3))
  + (p1 * (n1 - N1) + p2 * (n2 - N2) + p3 * (n3 - N3))
  - (256b-53 * (z1 * N1 + z2 * N2 + z3 * N3));
compared - exact -> (value - exact) + value * c;

# Refused: kMinOutward * 0.25
