"""Checks certificates by exact arithmetic, from vertices and poses alone.

Everything is a rational number (fractions.Fraction), so nothing is rounded: a vertex, a translation
and the components of a quaternion are doubles, and the rotation of a quaternion q is a matrix of
integers in these, divided by |q|^2. The server is trusted only for the stored hulls and bodies at
the revisions named in the answer.
"""

from __future__ import annotations

from hulld.verification.error import VerificationError
from hulld.verification.verifier import DEFAULT_MAX_TIME_ERROR, Verifier

__all__ = ["DEFAULT_MAX_TIME_ERROR", "VerificationError", "Verifier"]
