#!/usr/bin/env python3
"""Checks that the compose files of docker/ name existing things: compose_test.py SOURCE HULLD

Needs no container engine. Checks the services, networks, volumes, and mounted files, the settings of
hulld, and the servers in the configurations of haproxy and Prometheus.
"""

import pathlib
import re
import subprocess
import sys
import unittest

import yaml

SOURCE, HULLD = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])
DOCKER = SOURCE / 'docker'
FILES = sorted(DOCKER.glob('compose*.yaml'))


def services(path):
    return yaml.safe_load(path.read_text())['services']


class Compose(unittest.TestCase):
    def test_both_files_exist(self):
        self.assertEqual([path.name for path in FILES], ['compose.many.yaml', 'compose.yaml'])

    def test_everything_that_a_service_names_exists(self):
        for path in FILES:
            content = yaml.safe_load(path.read_text())
            for name, service in content['services'].items():
                with self.subTest(path=path.name, service=name):
                    for volume in service.get('volumes', []):
                        source = volume.split(':')[0]
                        if source.startswith('.'):
                            self.assertTrue((DOCKER / source).exists(), source)
                        else:
                            self.assertIn(source, content['volumes'])
                    self.assertLessEqual(set(service.get('networks', [])),
                                         set(content.get('networks', {})))
                    self.assertLessEqual(set(service.get('depends_on', [])),
                                         set(content['services']))
                    build = service.get('build')
                    if build:
                        self.assertTrue((DOCKER / build['context'] / build['dockerfile']).exists())

    def test_hulld_knows_its_settings(self):
        known = set(re.findall(r'--[a-z-]+', subprocess.run(
            [HULLD, '--help'], check=True, capture_output=True, text=True).stdout))
        for path in FILES:
            for name, service in services(path).items():
                for variable in service.get('environment', {}):
                    if variable.startswith('HULLD_'):
                        flag = '--' + variable.removeprefix('HULLD_').lower().replace('_', '-')
                        self.assertIn(flag, known, f'{path.name}: {name}')

    def test_haproxy_and_prometheus_know_every_server(self):
        servers = {name for name, service in services(DOCKER / 'compose.many.yaml').items()
                   if 'HULLD_STORE' in service.get('environment', {})}
        balanced = re.findall(r'^  server (\S+) \1:50551$',
                              (DOCKER / 'haproxy/haproxy.cfg').read_text(), re.MULTILINE)
        self.assertEqual(set(balanced), servers)
        prometheus = yaml.safe_load((DOCKER / 'prometheus/prometheus.many.yml').read_text())
        targets = prometheus['scrape_configs'][0]['static_configs'][0]['targets']
        self.assertEqual(set(targets), {f'{server}:9551' for server in servers})


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
