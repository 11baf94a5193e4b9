#!/usr/bin/env python3
"""Proves error bounds with Gappa.

  prove_bounds.py prove CONSTANTS SCRIPT.g    proves the script, and checks that its mutants fail
  prove_bounds.py expand CONSTANTS SCRIPT.g   prints the script as Gappa reads it
  prove_bounds.py complete HEADER FOLDER      checks that each bound of the header has a proof: in
                                              a script of the folder, or by hand in its README.md

CONSTANTS: a program that prints the C++ constants, one name and hexadecimal double per line.

In a script a name k... stands for the C++ constant, so that the proof covers the compiled value.
fl(EXPRESSION) rounds every +, - and * in it, by Gappa's operators for any relative error of at most
2^-53. A line "# Refused: kName * 0.7" or "# Refused: kName - 1 step" is a mutant: with that
constant instead Gappa must find no proof, so that no script proves a vacuous statement.
"""

import ast
import math
import pathlib
import re
import subprocess
import sys

CONSTANT = re.compile(r'\bk[A-Z]\w*')
MUTANT = re.compile(r'# Refused: (k\w+) (?:\* ([0-9.]+)|= (0x[0-9a-f.p-]+)|- 1 step)$')
# Output of Gappa that occurs only for a bound that it cannot prove.
REFUSED = re.compile(
    r'^Error: (some properties were not satisfied|no contradiction was found)', re.MULTILINE)
OPERATORS = {ast.Add: 'add_rel', ast.Sub: 'sub_rel', ast.Mult: 'mul_rel'}


def read_constants(program):
    lines = subprocess.run([program], check=True, capture_output=True, text=True).stdout.split('\n')
    return {name: float.fromhex(value) for name, value in (line.split() for line in lines if line)}


def rounded(node):
    """An expression with every operation rounded."""
    if isinstance(node, ast.BinOp):
        operator = OPERATORS[type(node.op)]
        return f'{operator}<53>({rounded(node.left)}, {rounded(node.right)})'
    if isinstance(node, ast.UnaryOp):
        return f'-({rounded(node.operand)})'
    if isinstance(node, ast.Call) and node.func.id == "abs":
        return f"|{rounded(node.args[0])}|"
    return ast.unparse(node)


def expand_rounding(text):
    """Replaces each fl(...)."""
    while (found := re.search(r'\bfl\(', text)) is not None:
        depth, end = 1, found.end()
        while depth > 0:
            depth += {'(': 1, ')': -1}.get(text[end], 0)
            end += 1
        inner = ast.parse(text[found.end():end - 1].strip(), mode='eval').body
        text = text[:found.start()] + rounded(inner) + text[end:]
    return text


def expand(text, constants):
    """Returns the script as Gappa reads it."""
    code = re.sub(r'#.*', '', text)
    unknown = set(CONSTANT.findall(code)) - set(constants)
    if unknown:
        sys.exit(f'no such constant in C++: {", ".join(sorted(unknown))}')
    return CONSTANT.sub(lambda name: constants[name[0]].hex(), expand_rounding(code))


def is_proved(text):
    gappa = subprocess.run(['gappa', '-Eprecision=256'], input=text, capture_output=True, text=True)
    if gappa.returncode == 0:
        # A rewriting that Gappa cannot check would be an assumption.
        if re.search(r'Warning: (?!no need for the rewriting)', gappa.stderr):
            sys.exit(f'Gappa warns:\n{gappa.stderr}')
        return True
    if not REFUSED.search(gappa.stderr):
        sys.exit(f'Gappa cannot read the script:\n{gappa.stderr}')
    return False


def mutants(text, constants):
    for line in text.split('\n'):
        if line.startswith('# Refused'):
            mutant = MUTANT.match(line)
            if mutant is None:
                sys.exit(f'cannot read "{line}"')
            name, factor, value = mutant.groups()
            if factor is not None:
                yield name, constants[name] * float(factor)
            elif value is not None:
                yield name, float.fromhex(value)
            else:
                yield name, math.nextafter(constants[name], 0)


def prove(constants, script):
    text = script.read_text()
    if not is_proved(expand(text, constants)):
        sys.exit(f'{script.name}: Gappa finds no proof with the C++ constants')
    mutated = set()
    for name, value in mutants(text, constants):
        if is_proved(expand(text, constants | {name: value})):
            sys.exit(f'{script.name}: also holds with {name} = {value.hex()}, so it proves nothing')
        mutated.add(name)
        print(f'{script.name}: {name} = {constants[name].hex()} proved, {value.hex()} refused')
    if not mutated:
        sys.exit(f'{script.name}: no mutant, so nothing shows that it proves anything')


def check_complete(header, folder):
    bounds = set(re.findall(r'^inline constexpr double (k\w+) =', header.read_text(), re.MULTILINE))
    page = (folder / 'README.md').read_text()
    by_hand = set(re.findall(r'^- `(k\w+)`', page, re.MULTILINE))
    proved = set()
    for script in folder.rglob('*.g'):
        proved |= {mutant[1] for line in script.read_text().split('\n')
                   if (mutant := MUTANT.match(line))}
        if f'`{script.name}`' not in page:
            sys.exit(f'{folder}/README.md does not name {script.name}')
    for name in sorted(bounds):
        if name not in proved and name not in by_hand:
            sys.exit(f'{name} has neither a script nor a proof by hand in {folder}/README.md')
    for name in sorted(by_hand):
        if name not in bounds or name in proved:
            sys.exit(f'{folder}/README.md proves {name} by hand, although it needs no such proof')
    if not bounds:
        sys.exit(f'{header} contains no bound that this script can read')
    print(f'{len(bounds & proved)} bounds by Gappa, {len(by_hand)} by hand')


def main():
    match sys.argv[1:]:
        case ['prove', constants, script]:
            prove(read_constants(constants), pathlib.Path(script))
        case ['expand', constants, script]:
            print(expand(pathlib.Path(script).read_text(), read_constants(constants)))
        case ['complete', header, folder]:
            check_complete(pathlib.Path(header), pathlib.Path(folder))
        case _:
            sys.exit(__doc__)


if __name__ == '__main__':
    main()
