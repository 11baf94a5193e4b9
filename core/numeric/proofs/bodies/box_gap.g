# The gap between two boxes along axes of either, in units of S = M_X + M_Y + |t|, with parts P, (1
# - P) Q and (1 - P) (1 - Q); one component of each. The entries A, B of the two bodies' rotations
# err by g and h, and their product R_XY by k. A center c and a half width are halves of a sum and a
# difference of two doubles: one rounding, m.
#
# By hand: an absolute value errs as its argument does, so the gap is proved without them; Eigen may
# add three products in another order, with the same bound; a component of the exact step is at most
# 3 (1 - P) + P, because entries are at most 1.

entry = fl((A1 + g1) * (B1 + h1) + (A2 + g2) * (B2 + h2) + (A3 + g3) * (B3 + h3));
exact_entry = A1 * B1 + A2 * B2 + A3 * B3;

Y = (1 - P) * Q;
T = (1 - P) * (1 - Q);
t1 = T * z1 * (1 + e1); t2 = T * z2 * (1 + e2); t3 = T * z3 * (1 + e3);
moved = fl((A1 + g1) * t1 + (A2 + g2) * t2 + (A3 + g3) * t3);
exact_moved = T * (A1 * z1 + A2 * z2 + A3 * z3);
c1 = Y * y1 * (1 + m1); c2 = Y * y2 * (1 + m2); c3 = Y * y3 * (1 + m3);
turned = fl((R1 + k1) * c1 + (R2 + k2) * c2 + (R3 + k3) * c3);
exact_turned = Y * (R1 * y1 + R2 * y2 + R3 * y3);
c = P * x * (1 + m4);
step = fl(turned + moved - c);
exact_step = exact_turned + exact_moved - P * x;

half_x = P * w * (1 + m5);
w1 = Y * v1 * (1 + n1); w2 = Y * v2 * (1 + n2); w3 = Y * v3 * (1 + n3);
halves = fl((R1 + k1) * w1 + (R2 + k2) * w2 + (R3 + k3) * w3);
exact_halves = Y * (R1 * v1 + R2 * v2 + R3 * v3);
gap_x = fl(step - half_x - halves);
exact_gap_x = exact_step - P * w - exact_halves;

step1 = S1 + s1; step2 = S2 + s2; step3 = S3 + s3;
back = fl((R1 + k1) * step1 + (R2 + k2) * step2 + (R3 + k3) * step3);
exact_back = R1 * S1 + R2 * S2 + R3 * S3;
w4 = P * u1 * (1 + m1); w5 = P * u2 * (1 + m2); w6 = P * u3 * (1 + m3);
others = fl((R1 + k1) * w4 + (R2 + k2) * w5 + (R3 + k3) * w6);
exact_others = P * (R1 * u1 + R2 * u2 + R3 * u3);
gap_y = fl(back - w1 - others);
exact_gap_y = exact_back - Y * v1 - exact_others;

{ P in [0, 1] /\ Q in [0, 1]
  /\ |A1| <= 1 /\ |A2| <= 1 /\ |A3| <= 1 /\ |B1| <= 1 /\ |B2| <= 1 /\ |B3| <= 1
  /\ |R1| <= 1 /\ |R2| <= 1 /\ |R3| <= 1
  /\ |g1| <= kRotationEntryError /\ |g2| <= kRotationEntryError /\ |g3| <= kRotationEntryError
  /\ |h1| <= kRotationEntryError /\ |h2| <= kRotationEntryError /\ |h3| <= kRotationEntryError
  /\ |k1| <= 120b-53 /\ |k2| <= 120b-53 /\ |k3| <= 120b-53
  /\ |z1| <= 1 /\ |z2| <= 1 /\ |z3| <= 1 /\ |y1| <= 1 /\ |y2| <= 1 /\ |y3| <= 1
  /\ |x| <= 1 /\ |w| <= 1 /\ |v1| <= 1 /\ |v2| <= 1 /\ |v3| <= 1
  /\ |u1| <= 1 /\ |u2| <= 1 /\ |u3| <= 1
  /\ |e1| <= kUnitRoundoff /\ |e2| <= kUnitRoundoff /\ |e3| <= kUnitRoundoff
  /\ |m1| <= kUnitRoundoff /\ |m2| <= kUnitRoundoff /\ |m3| <= kUnitRoundoff
  /\ |m4| <= kUnitRoundoff /\ |m5| <= kUnitRoundoff
  /\ |n1| <= kUnitRoundoff /\ |n2| <= kUnitRoundoff /\ |n3| <= kUnitRoundoff
  /\ |S1| <= 3 /\ |S2| <= 3 /\ |S3| <= 3
  /\ |s1| <= 450b-53 /\ |s2| <= 450b-53 /\ |s3| <= 450b-53
  -> |entry - exact_entry| <= 120b-53 /\ |step - exact_step| <= 450b-53
  /\ |gap_x - exact_gap_x| <= kBoxGapErrorFactor /\ |gap_y - exact_gap_y| <= kBoxGapErrorFactor }

entry - exact_entry -> (entry - ((A1 + g1) * (B1 + h1) + (A2 + g2) * (B2 + h2) + (A3 + g3) * (B3 + h3)))
  + (g1 * (B1 + h1) + A1 * h1 + g2 * (B2 + h2) + A2 * h2 + g3 * (B3 + h3) + A3 * h3);
moved - exact_moved -> (moved - ((A1 + g1) * t1 + (A2 + g2) * t2 + (A3 + g3) * t3))
  + (g1 * t1 + g2 * t2 + g3 * t3) + T * (A1 * z1 * e1 + A2 * z2 * e2 + A3 * z3 * e3);
turned - exact_turned -> (turned - ((R1 + k1) * c1 + (R2 + k2) * c2 + (R3 + k3) * c3))
  + (k1 * c1 + k2 * c2 + k3 * c3) + Y * (R1 * y1 * m1 + R2 * y2 * m2 + R3 * y3 * m3);
step - exact_step -> (step - (turned + moved - c)) + (turned - exact_turned)
  + (moved - exact_moved) - P * x * m4;
halves - exact_halves -> (halves - ((R1 + k1) * w1 + (R2 + k2) * w2 + (R3 + k3) * w3))
  + (k1 * w1 + k2 * w2 + k3 * w3) + Y * (R1 * v1 * n1 + R2 * v2 * n2 + R3 * v3 * n3);
gap_x - exact_gap_x -> (gap_x - (step - half_x - halves)) + (step - exact_step) - P * w * m5
  - (halves - exact_halves);
back - exact_back -> (back - ((R1 + k1) * step1 + (R2 + k2) * step2 + (R3 + k3) * step3))
  + (k1 * step1 + k2 * step2 + k3 * step3) + (R1 * s1 + R2 * s2 + R3 * s3);
others - exact_others -> (others - ((R1 + k1) * w4 + (R2 + k2) * w5 + (R3 + k3) * w6))
  + (k1 * w4 + k2 * w5 + k3 * w6) + P * (R1 * u1 * m1 + R2 * u2 * m2 + R3 * u3 * m3);
gap_y - exact_gap_y -> (gap_y - (back - w1 - others)) + (back - exact_back) - Y * v1 * n1
  - (others - exact_others);
$ P in 4, Q in 4;

# Refused: kBoxGapErrorFactor * 0.45
