# A component of R(q) p / |q|^2 + t in double-double arithmetic (double_double.h), in units of the
# largest component of p plus that of t, with parts P and 1 - P; |q| = 1. An operation errs by d of
# its result: 3 u^2 for a sum, 5 u^2 for a product, 17 u^2 for a quotient, with 0.01 u^2 for higher
# powers of u; double_double.h names the theorems.
#
# By hand: a numerator n is a sum of four exact products of components of q with sizes that sum to
# at most 1, added two by two, so it errs by two roundings of sums: 6.1 u^2; the squared norm, a sum
# of positive terms, by as much of itself; `inverse` is the error of its reciprocal.

v1 = P * x1; v2 = P * x2; v3 = P * x3;
t = (1 - P) * y;
inverse = 1 / ((1 + m1) * (1 + m2));
r1 = (R1 + n1) * (1 + i) * (1 + q1);
r2 = (R2 + n2) * (1 + i) * (1 + q2);
r3 = (R3 + n3) * (1 + i) * (1 + q3);
s12 = (r1 * v1 * (1 + p1) + r2 * v2 * (1 + p2)) * (1 + a1);
turned = (s12 + r3 * v3 * (1 + p3)) * (1 + a2);
sum = (turned + t) * (1 + a3);
exact_turned = R1 * v1 + R2 * v2 + R3 * v3;
exact = exact_turned + t;

{ P in [0, 1] /\ |y| <= 1 /\ |x1| <= 1 /\ |x2| <= 1 /\ |x3| <= 1
  /\ |R1| <= 1 /\ |R2| <= 1 /\ |R3| <= 1
  /\ |n1| <= 0x6.2p-106 /\ |n2| <= 0x6.2p-106 /\ |n3| <= 0x6.2p-106
  /\ |m1| <= 0x3.03p-106 /\ |m2| <= 0x3.03p-106 /\ |i| <= 0x6.2p-106
  /\ |q1| <= 0x11.03p-106 /\ |q2| <= 0x11.03p-106 /\ |q3| <= 0x11.03p-106
  /\ |p1| <= 0x5.03p-106 /\ |p2| <= 0x5.03p-106 /\ |p3| <= 0x5.03p-106
  /\ |a1| <= 0x3.03p-106 /\ |a2| <= 0x3.03p-106 /\ |a3| <= 0x3.03p-106
  -> |inverse - 1| <= 0x6.2p-106 /\ |sum - exact| <= kProductTranslationError }

r1 - R1 -> n1 * (1 + i) * (1 + q1) + R1 * ((1 + i) * (1 + q1) - 1);
r2 - R2 -> n2 * (1 + i) * (1 + q2) + R2 * ((1 + i) * (1 + q2) - 1);
r3 - R3 -> n3 * (1 + i) * (1 + q3) + R3 * ((1 + i) * (1 + q3) - 1);
turned - exact_turned -> (r1 - R1) * v1 + (r2 - R2) * v2 + (r3 - R3) * v3
  + r1 * v1 * ((1 + p1) * (1 + a1) * (1 + a2) - 1) + r2 * v2 * ((1 + p2) * (1 + a1) * (1 + a2) - 1)
  + r3 * v3 * ((1 + p3) * (1 + a2) - 1);
sum - exact -> (turned - exact_turned) * (1 + a3) + (exact_turned + t) * a3;
$ P in 8;

# Refused: kProductTranslationError * 0.45
