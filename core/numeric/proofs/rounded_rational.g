# A rational number or a root cut to 60 bits or more, and then rounded to a double, in terms of
# the double: (1 + c) (1 + d) of it. The bound is computed with one rounding, too.

needed = 1 / ((1 + c) * (1 + d)) - 1;
bound = kRoundedRelativeError * (1 + d2);

{ |c| <= 1b-60 /\ |d| <= kUnitRoundoff /\ |d2| <= kUnitRoundoff -> |needed / bound| <= 1 }

# Refused: kRoundedRelativeError * 0.5
