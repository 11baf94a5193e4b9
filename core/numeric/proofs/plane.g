# The plane of a triangle a, b, c: normal = e x f of the computed edges, offset = fl(normal . a),
# and normal . q - offset for a point q. Units: |e|, |f| and |q| + |a| are 1, largest components;
# the value is of degree one in each of these. |q| = P, |a| = 1 - P.

e1 = fl(b1 - a1); e2 = fl(b2 - a2); e3 = fl(b3 - a3);
f1 = fl(c1 - a1); f2 = fl(c2 - a2); f3 = fl(c3 - a3);
E1 = b1 - a1; E2 = b2 - a2; E3 = b3 - a3;
F1 = c1 - a1; F2 = c2 - a2; F3 = c3 - a3;
n1 = fl(e2 * f3 - e3 * f2); n2 = fl(e3 * f1 - e1 * f3); n3 = fl(e1 * f2 - e2 * f1);
N1 = E2 * F3 - E3 * F2; N2 = E3 * F1 - E1 * F3; N3 = E1 * F2 - E2 * F1;

q1 = P * x1; q2 = P * x2; q3 = P * x3;
# The corner a again, in the unit of |q| + |a|.
A = 1 - P;
r1 = A * y1; r2 = A * y2; r3 = A * y3;

at_q = fl(n1 * q1 + n2 * q2 + n3 * q3);
offset = fl(n1 * r1 + n2 * r2 + n3 * r3);
value = fl(at_q - offset);
exact = (N1 * q1 + N2 * q2 + N3 * q3) - (N1 * r1 + N2 * r2 + N3 * r3);

# The computed bound: the factor, |e| and |f| with their roundings, rounded up and to a float, times
# fl(|q| + |a|), which is rounded twice with the product.
bound = kPlaneErrorFactor * s * kPlaneSlopeRoundUp * (1 + to_float) * (1 + d1) * (1 + d2);

# The audit's side of a facet's plane. By hand: its error is at most the sum of the errors of three
# terms N O, with O a component of p - a, the unit here; N, in units of 2^63, errs by n, and the
# term rounds with the difference, the product and two sums. Its part of the bound rounds as O does,
# in two sums of absolute components, and with the factor.
term = (N + n) * (1 + t1) * (1 + t2) * (1 + t3) * (1 + t4);
audit = kAuditErrorFactor * (1 + t1) * (1 + t5) * (1 + t6) * (1 + t7);

{ |E1| <= 1 /\ |E2| <= 1 /\ |E3| <= 1 /\ |F1| <= 1 /\ |F2| <= 1 /\ |F3| <= 1 /\ P in [0, 1]
  /\ |x1| <= 1 /\ |x2| <= 1 /\ |x3| <= 1 /\ |y1| <= 1 /\ |y2| <= 1 /\ |y3| <= 1
  /\ s in [0x0.fffffffffffcp0, 0x1.00000000001p0] /\ |to_float| <= 1b-24
  /\ |d1| <= kUnitRoundoff /\ |d2| <= kUnitRoundoff
  /\ |N| <= 1 /\ |n| <= 1b-52 /\ |t1| <= kUnitRoundoff /\ |t2| <= kUnitRoundoff
  /\ |t3| <= kUnitRoundoff /\ |t4| <= kUnitRoundoff /\ |t5| <= kUnitRoundoff
  /\ |t6| <= kUnitRoundoff /\ |t7| <= kUnitRoundoff
  -> |(value - exact) / bound| <= 1 /\ |(term - N) / audit| <= 1 }

value - exact -> (value - (at_q - offset))
  + ((at_q - (N1 * q1 + N2 * q2 + N3 * q3)) - (offset - (N1 * r1 + N2 * r2 + N3 * r3)));
term - N -> n * (1 + t1) * (1 + t2) * (1 + t3) * (1 + t4)
  + N * ((1 + t1) * (1 + t2) * (1 + t3) * (1 + t4) - 1);
$ P in 16;

# Refused: kPlaneErrorFactor * 0.7
# Refused: kAuditErrorFactor * 0.18
