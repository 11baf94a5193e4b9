#!/usr/bin/env python3
"""Scripts that prove nothing, or not the bounds of the constants, are rejected as proofs."""

import contextlib
import io
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import prove_bounds  # noqa: E402

SOUND = '{ |d| <= kUnit -> |d + d| <= kTwice }\n# Refused: kTwice * 0.9\n'


def outcome(text, unit=0.125, twice=0.25):
    """Returns None if the script counts as a proof, otherwise the error."""
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        script = pathlib.Path(folder, 'script.g')
        script.write_text(text)
        try:
            prove_bounds.prove({'kUnit': unit, 'kTwice': twice}, script)
        except SystemExit as refusal:
            return refusal.code
    return None


class ProveBounds(unittest.TestCase):
    def test_a_sound_script_is_proved(self):
        self.assertIsNone(outcome(SOUND))

    def test_a_smaller_constant_is_refused(self):
        self.assertIn('finds no proof', outcome(SOUND, twice=0.2))

    def test_assumptions_that_contradict_each_other_prove_nothing(self):
        self.assertIn('so it proves nothing', outcome(SOUND.replace('{', '{ d >= 9 /\\')))

    def test_a_script_without_a_mutant_is_refused(self):
        self.assertIn('no mutant', outcome(SOUND.split('\n')[0]))

    def test_a_mutant_that_cannot_be_read_is_refused(self):
        self.assertIn('cannot read', outcome(SOUND.replace('* 0.9', 'halved')))

    def test_a_constant_that_is_not_in_cpp_is_refused(self):
        self.assertIn('kThrice', outcome(SOUND.replace('kUnit', 'kThrice')))

    def test_a_script_that_gappa_cannot_read_is_reported(self):
        self.assertIn('cannot read', outcome(SOUND.replace('->', '=>')))

    def test_rewriting_to_something_else_is_refused(self):
        self.assertIn('warns', outcome(SOUND.replace('}', '}\nd + d -> d;')))

    def test_each_operation_is_rounded(self):
        self.assertEqual(prove_bounds.expand_rounding('x = fl(a * b - abs(c));'),
                         'x = sub_rel<53>(mul_rel<53>(a, b), |c|);')


if __name__ == '__main__':
    unittest.main()
