# Rounding itself. A result in [1, 2) errs by at most u; by hand, a power of two changes only the
# exponent, so any normal result errs by at most u of itself. A smaller one errs by at most 2^-1075.
# All other scripts assume only the first of these, for any sizes (README.md).

y = float<ieee_64, ne>(x);
narrow_y = float<ieee_32, ne>(x);
tiny_y = float<ieee_64, ne>(tiny);

{ x in [1, 2] /\ |tiny| <= 1b-1022 ->
  |y - x| <= kUnitRoundoff /\ |narrow_y - x| <= kFloatUnitRoundoff /\ |tiny_y - tiny| <= 1b-1075 }

# Refused: kUnitRoundoff * 0.999
# Refused: kFloatUnitRoundoff * 0.999
