"""Checks certificates in exact arithmetic, from vertices and poses alone.

All numbers are rational (fractions.Fraction), so nothing is rounded: vertices, translations, and
the components of quaternions are doubles, and the rotation of a quaternion q is a matrix of
polynomials in its components, divided by |q|^2. The server is trusted only for the stored hulls and
bodies at the revisions that the answer names.
"""

from __future__ import annotations

from hulld.verification.error import VerificationError
from hulld.verification.verifier import DEFAULT_MAX_TIME_ERROR, Verifier

__all__ = ["DEFAULT_MAX_TIME_ERROR", "VerificationError", "Verifier"]
