# The largest value n . w over A - B, as FloatPair finds it: n is rotated into each hull's frame,
# which gives own; the values there are compared, and found correctly up to the blur of the support
# map. Units: |n| = 1 and S = 1, with parts P, (1 - P) Q and (1 - P) (1 - Q) for M_A, M_B and |t|. n
# itself may err by 16 u per component, e.
#
# By hand: a component of w is at most sqrt(3) S, and a bound for each vertex holds for the largest.

a1 = P * x1; a2 = P * x2; a3 = P * x3;
B = (1 - P) * Q;
b1 = B * y1; b2 = B * y2; b3 = B * y3;
T = (1 - P) * (1 - Q);
t1 = T * z1; t2 = T * z2; t3 = T * z3;

r11 = R11 + g11; r12 = R12 + g12; r13 = R13 + g13;
r21 = R21 + g21; r22 = R22 + g22; r23 = R23 + g23;
r31 = R31 + g31; r32 = R32 + g32; r33 = R33 + g33;
q11 = Q11 + h11; q12 = Q12 + h12; q13 = Q13 + h13;
q21 = Q21 + h21; q22 = Q22 + h22; q23 = Q23 + h23;
q31 = Q31 + h31; q32 = Q32 + h32; q33 = Q33 + h33;

own_a1 = fl(r11 * n1 + r12 * n2 + r13 * n3); Own_a1 = R11 * n1 + R12 * n2 + R13 * n3;
own_a2 = fl(r21 * n1 + r22 * n2 + r23 * n3); Own_a2 = R21 * n1 + R22 * n2 + R23 * n3;
own_a3 = fl(r31 * n1 + r32 * n2 + r33 * n3); Own_a3 = R31 * n1 + R32 * n2 + R33 * n3;
own_b1 = fl(q11 * n1 + q12 * n2 + q13 * n3); Own_b1 = Q11 * n1 + Q12 * n2 + Q13 * n3;
own_b2 = fl(q21 * n1 + q22 * n2 + q23 * n3); Own_b2 = Q21 * n1 + Q22 * n2 + Q23 * n3;
own_b3 = fl(q31 * n1 + q32 * n2 + q33 * n3); Own_b3 = Q31 * n1 + Q32 * n2 + Q33 * n3;

value_a = fl(own_a1 * a1 + own_a2 * a2 + own_a3 * a3);
Value_a = Own_a1 * a1 + Own_a2 * a2 + Own_a3 * a3;
value_b = fl(own_b1 * b1 + own_b2 * b2 + own_b3 * b3);
Value_b = Own_b1 * b1 + Own_b2 * b2 + Own_b3 * b3;
o1 = t1 * (1 + d1); o2 = t2 * (1 + d2); o3 = t3 * (1 + d3);
value_t = fl(n1 * o1 + n2 * o2 + n3 * o3);
Value_t = n1 * t1 + n2 * t2 + n3 * t3;
both = fl(value_a + value_b);
value = fl(both - value_t);
exact = Value_a + Value_b - Value_t;

blur = kSupportBlurFactor * (P * blur_a + B * blur_b);
tilt = e1 * w1 + e2 * w2 + e3 * w3;

{ P in [0, 1] /\ Q in [0, 1] /\ |n1| <= 1 /\ |n2| <= 1 /\ |n3| <= 1
  /\ |x1| <= 1 /\ |x2| <= 1 /\ |x3| <= 1 /\ |y1| <= 1 /\ |y2| <= 1 /\ |y3| <= 1
  /\ |z1| <= 1 /\ |z2| <= 1 /\ |z3| <= 1
  /\ |R11| <= 1 /\ |R12| <= 1 /\ |R13| <= 1 /\ |R21| <= 1 /\ |R22| <= 1 /\ |R23| <= 1
  /\ |R31| <= 1 /\ |R32| <= 1 /\ |R33| <= 1
  /\ |Q11| <= 1 /\ |Q12| <= 1 /\ |Q13| <= 1 /\ |Q21| <= 1 /\ |Q22| <= 1 /\ |Q23| <= 1
  /\ |Q31| <= 1 /\ |Q32| <= 1 /\ |Q33| <= 1
  /\ |g11| <= kRotationEntryError /\ |g12| <= kRotationEntryError /\ |g13| <= kRotationEntryError
  /\ |g21| <= kRotationEntryError /\ |g22| <= kRotationEntryError /\ |g23| <= kRotationEntryError
  /\ |g31| <= kRotationEntryError /\ |g32| <= kRotationEntryError /\ |g33| <= kRotationEntryError
  /\ |h11| <= kRotationEntryError /\ |h12| <= kRotationEntryError /\ |h13| <= kRotationEntryError
  /\ |h21| <= kRotationEntryError /\ |h22| <= kRotationEntryError /\ |h23| <= kRotationEntryError
  /\ |h31| <= kRotationEntryError /\ |h32| <= kRotationEntryError /\ |h33| <= kRotationEntryError
  /\ |d1| <= kUnitRoundoff /\ |d2| <= kUnitRoundoff /\ |d3| <= kUnitRoundoff
  /\ |blur_a| <= 1 /\ |blur_b| <= 1 /\ |e1| <= 16b-53 /\ |e2| <= 16b-53 /\ |e3| <= 16b-53
  /\ |w1| <= 0x1.bb67bp0 /\ |w2| <= 0x1.bb67bp0 /\ |w3| <= 0x1.bb67bp0
  -> |(value - exact) + blur + tilt| <= kSupportErrorFactor }

own_a1 - Own_a1 -> (own_a1 - (r11 * n1 + r12 * n2 + r13 * n3)) + (g11 * n1 + g12 * n2 + g13 * n3);
own_a2 - Own_a2 -> (own_a2 - (r21 * n1 + r22 * n2 + r23 * n3)) + (g21 * n1 + g22 * n2 + g23 * n3);
own_a3 - Own_a3 -> (own_a3 - (r31 * n1 + r32 * n2 + r33 * n3)) + (g31 * n1 + g32 * n2 + g33 * n3);
own_b1 - Own_b1 -> (own_b1 - (q11 * n1 + q12 * n2 + q13 * n3)) + (h11 * n1 + h12 * n2 + h13 * n3);
own_b2 - Own_b2 -> (own_b2 - (q21 * n1 + q22 * n2 + q23 * n3)) + (h21 * n1 + h22 * n2 + h23 * n3);
own_b3 - Own_b3 -> (own_b3 - (q31 * n1 + q32 * n2 + q33 * n3)) + (h31 * n1 + h32 * n2 + h33 * n3);
value_a - Value_a -> (value_a - (own_a1 * a1 + own_a2 * a2 + own_a3 * a3))
  + ((own_a1 - Own_a1) * a1 + (own_a2 - Own_a2) * a2 + (own_a3 - Own_a3) * a3);
value_b - Value_b -> (value_b - (own_b1 * b1 + own_b2 * b2 + own_b3 * b3))
  + ((own_b1 - Own_b1) * b1 + (own_b2 - Own_b2) * b2 + (own_b3 - Own_b3) * b3);
value_t - Value_t -> (value_t - (n1 * o1 + n2 * o2 + n3 * o3))
  + (n1 * t1 * d1 + n2 * t2 * d2 + n3 * t3 * d3);
value - exact -> (value - (both - value_t)) + (both - (value_a + value_b))
  + (value_a - Value_a) + (value_b - Value_b) - (value_t - Value_t);
$ P in 8, Q in 4;

# Refused: kSupportErrorFactor * 0.7
