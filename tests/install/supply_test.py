#!/usr/bin/env python3
"""What hulld is made of is written down: supply_test.py SOURCE HULLD HULLCTL

The table of docker/README.md names every package of the sections build and run of
docker/packages.txt, and none else; the list that docker/sbom.sh makes of an image can be read, and
names what the programs are linked with.
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

SOURCE, *PROGRAMS = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
DOCKER = SOURCE / 'docker'


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def packages(*sections):
    return set(output('bash', DOCKER / 'packages.sh', 'list', *sections).split())


def linked_packages(program):
    """By another way than sbom.sh: the packages whose lists of files hold the library."""
    libraries = {pathlib.Path(path).resolve()
                 for path in re.findall(r'(/\S+)', output('ldd', program))}
    owners = subprocess.run(['dpkg', '-S', *(f'*/{library.name}' for library in libraries)],
                            capture_output=True, text=True)
    found = {}
    for line in owners.stdout.splitlines():
        names, path = line.rsplit(': ', 1)
        if (real := pathlib.Path(path).resolve()) in libraries:
            found[real] = names.split(':')[0]
    assert set(found) == libraries, libraries - set(found)
    return set(found.values())


class Table(unittest.TestCase):
    def test_it_names_every_package(self):
        page = (DOCKER / 'README.md').read_text()
        section = page.split('\n## Dependencies\n')[1].split('\n## ')[0]
        rows = [line.split('|') for line in section.splitlines() if line.startswith('| `')]
        named = {name for row in rows for name in re.findall(r'`([^`]+)`', row[1])}
        self.assertEqual(named, packages('build', 'run'))
        for row in rows:
            self.assertEqual(len(row), 6, row)
            self.assertTrue(all(cell.strip() for cell in row[1:5]), row)

    def test_versions_are_those_of_debian(self):
        page = (DOCKER / 'README.md').read_text()
        for names, version in re.findall(r'^\| (`.*?`) \| ([^|]*?) \|', page, re.MULTILINE):
            for name in re.findall(r'`([^`]+)`', names):
                if name not in packages('build', 'run'):
                    continue
                installed = output('dpkg-query', '-W', '-f', '${Version}\n', name).split()[0]
                # Debian's own revision, which a security update raises, does not count; nor does the
                # minor version of PostgreSQL, which it raises as well.
                upstream = re.match(r'(\d+:)?([0-9.]*[0-9])', installed)[2]
                if name.startswith('libpq'):
                    upstream = upstream.split('.')[0]
                self.assertEqual(version, upstream, name)


class Sbom(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with tempfile.NamedTemporaryFile('w+') as compiled_in:
            compiled_in.write(output('bash', DOCKER / 'sbom.sh', '--versions', 'build'))
            compiled_in.flush()
            cls.document = json.loads(output('bash', DOCKER / 'sbom.sh', '--compiled-in',
                                             compiled_in.name, *PROGRAMS))
        cls.names = {package['SPDXID']: package['name'] for package in cls.document['packages']}

    def related(self, kind, source=None):
        return {(one['spdxElementId'], one['relatedSpdxElement'])
                for one in self.document['relationships']
                if one['relationshipType'] == kind and source in (None, one['spdxElementId'])}

    def test_it_has_what_spdx_requires(self):
        for key in ('spdxVersion', 'dataLicense', 'SPDXID', 'name', 'documentNamespace'):
            self.assertTrue(self.document[key], key)
        self.assertRegex(self.document['creationInfo']['created'], r'^\d{4}-\d\d-\d\dT[\d:]{8}Z$')
        self.assertEqual(len(self.names), len(self.document['packages']), 'an ID is there twice')
        for package in self.document['packages']:
            self.assertRegex(package['SPDXID'], r'^SPDXRef-[A-Za-z0-9.-]+$')
            self.assertTrue(package['versionInfo'], package)
            self.assertTrue(package['downloadLocation'], package)
        for one in self.document['relationships']:
            self.assertIn(one['relatedSpdxElement'], self.names | {'SPDXRef-DOCUMENT': ''})
            self.assertIn(one['spdxElementId'], self.names | {'SPDXRef-DOCUMENT': ''})

    def test_it_describes_both_programs(self):
        self.assertEqual({self.names[end] for _, end in self.related('DESCRIBES')},
                         {'hulld', 'hullctl'})

    def test_it_says_under_which_licence_they_are(self):
        declared = {package['name']: package['licenseDeclared']
                    for package in self.document['packages']}
        self.assertEqual({declared['hulld'], declared['hullctl']}, {'Apache-2.0'})

    def test_it_names_what_each_program_is_linked_with(self):
        for program in PROGRAMS:
            linked = self.related('DYNAMIC_LINK', f'SPDXRef-Program-{program.name}')
            self.assertEqual({self.names[end] for _, end in linked}, linked_packages(program))

    def test_the_image_installs_what_the_programs_are_linked_with(self):
        linked = {self.names[end] for _, end in self.related('DYNAMIC_LINK')}
        self.assertLessEqual(packages('run'), linked)

    def test_it_names_what_is_compiled_in(self):
        inside = {self.names[start] for start, _ in self.related('BUILD_DEPENDENCY_OF')}
        self.assertEqual(inside, packages('build'))


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
