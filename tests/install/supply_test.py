#!/usr/bin/env python3
"""Checks the list of dependencies and the SBOM: supply_test.py SOURCE HULLD HULLCTL

The table of docker/README.md names every package of the sections build and run of
docker/packages.txt and no other. The SBOM that docker/sbom.sh prints is valid JSON, names the
libraries that the programs link, and contains the versions in dpkg's database.
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
    """Returns the packages that own the libraries, by a different method than sbom.sh."""
    libraries = {pathlib.Path(path).resolve()
                 for path in re.findall(r'(/\S+)', output('ldd', program))}
    names = {library.name for library in libraries}
    found = {}
    for contents in pathlib.Path('/var/lib/dpkg/info').glob('*.list'):
        for path in contents.read_text().splitlines():
            if (path.rpartition('/')[2] in names
                    and (real := pathlib.Path(path).resolve()) in libraries):
                found[real] = contents.stem.split(':')[0]
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
            self.assertEqual(len(row), 5, row)
            self.assertTrue(all(cell.strip() for cell in row[1:4]), row)


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

    def test_versions_are_the_installed_ones(self):
        installed = dict(line.split() for line in output(
            'dpkg-query', '-W', '-f', '${Package} ${Version}\n').splitlines())
        versions = {package['name']: package['versionInfo']
                    for package in self.document['packages']}
        for name in packages('build'):
            self.assertEqual(versions[name], installed[name], name)

    def test_it_describes_both_programs(self):
        self.assertEqual({self.names[end] for _, end in self.related('DESCRIBES')},
                         {'hulld', 'hullctl'})

    def test_it_states_the_license_of_both_programs(self):
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
