"""Tests of the certificate check of the viewer's page against the one of the C++ client.

    /usr/bin/python3 proof_test.py BIN_DIRECTORY [TEST...]
"""

import json
import pathlib
import subprocess
from random import Random

import viewer_case
from viewer_case import AT_REST


class ProofTest(viewer_case.ViewerCase):
    def page_verdict(self, response, request):
        """Returns the problem that the page finds in a recorded answer; empty if it is proven."""
        poses = []
        radii = [request[side].get("radius", 0) for side in "ab"]
        for side in "ab":
            pose = request[side].get("pose", {})
            rotation = pose.get("rotation", {"w": 1})
            poses.append([rotation.get(k, 0) for k in "wxyz"] +
                         [pose.get("translation", {}).get(k, 0) for k in "xyz"])
        return self.browser.driver.execute_async_script("""
          const [relation, certificate, ids, poses, radii, done] = arguments;
          import('hulld/proof/certificate.js').then(({certificateProblem}) => {
            const sides = ids.map((id, k) =>
                ({xyz: hulldViewer.model.hulls.get(id).xyz, poses: [poses[k].map(Number)],
                  radii: [radii[k]]}));
            done(certificateProblem(relation, certificate, ...sides));
          }).catch((error) => done(String(error)));""",
            response["relation"], response.get("certificate", {}),
            [request[side]["hullId"] for side in "ab"], poses, radii)

    def hullctl_verdict(self, record):
        target = pathlib.Path(self.hulld.directory, "judged.json")
        target.write_text(json.dumps(record))
        said = subprocess.run([*self.hulld.command(), "verify", str(target), "--output", "json"],
                              text=True, capture_output=True).stdout
        verdict = json.loads(said)
        return "" if verdict["verdict"] == "VALID" else verdict["reason"]

    def test_page_and_hullctl_judge_certificates_alike(self):
        random = Random(20)
        for name, count in (("proof/a", 12), ("proof/b", 30)):
            self.hulld.add(name, [" ".join(repr(random.gauss(0, 1)) for _ in range(3))
                                  for _ in range(count)])
        self.view("proof/a", "proof/b", "room/left", "room/right")
        record = pathlib.Path(self.hulld.directory, "record.json")
        questions = [("proof/a", "proof/b", [random.gauss(0, 1) for _ in range(4)] +
                      [random.gauss(0, far) for _ in range(3)], radius)
                     for far in (0.5, 0.5, 2, 4, 1e9) for radius in (0, 0.75)]
        # They share a face, an edge, or a corner; then they are 1.5 apart or 2.5.
        questions += [("room/left", "room/right", [1, 0, 0, 0, *t], radius)
                      for t, radius in (((-1, 0.3, 0), 0), ((-1, 1, 0), 0), ((-1, 1, -3), 0),
                                        ((0.5, 0.3, 0), 0.75), ((0.5, 3, 0), 1.25))]
        proven = refuted = 0
        relations = set()
        for a, b, pose, radius in questions:
            self.hulld.hullctl("check", a, b, "--certificate", "--record", str(record),
                               "--radius-a", repr(radius), "--radius-b", repr(radius),
                               "--pose-b", ",".join(map(repr, pose)))
            honest = json.loads(record.read_text())
            for forge in (lambda r: None, self.swap_relation, self.bend_direction, self.drop_pair,
                          self.move_index, self.move_vertex, self.use_integers):
                forged = json.loads(record.read_text())
                forge(forged["response"])
                said = self.page_verdict(forged["response"], honest["request"])
                self.assertEqual(said, self.hullctl_verdict(forged), forged["response"])
                relations.add(honest["response"]["relation"])
                proven += said == ""
                refuted += said != ""
        self.assertEqual(len(relations), 3)
        self.assertGreater(proven, 8)
        self.assertGreater(refuted, 8)

    @staticmethod
    def swap_relation(response):
        response["relation"] = {"RELATION_SEPARATED": "RELATION_TOUCHING",
                                "RELATION_TOUCHING": "RELATION_OVERLAPPING",
                                "RELATION_OVERLAPPING": "RELATION_SEPARATED"}[response["relation"]]

    @staticmethod
    def bend_direction(response):
        direction = response["certificate"].get("direction")
        if direction:
            direction["x"], direction["y"] = direction["y"], -direction["x"]

    @staticmethod
    def drop_pair(response):
        response["certificate"]["pairs"] = response["certificate"].get("pairs", [])[:-1]

    @staticmethod
    def move_index(response):
        for pair in response["certificate"].get("pairs", [])[:1]:
            pair["indexA"] = pair.get("indexA", 0) + 40

    @staticmethod
    def move_vertex(response):
        for pair in response["certificate"].get("pairs", [])[:1]:
            pair["vertexA"]["x"] += 1

    @staticmethod
    def use_integers(response):
        direction = response["certificate"].pop("direction", None)
        if direction:
            response["certificate"]["integerDirection"] = {
                k: str(int(direction.get(k, 0) * 2**60)) for k in "xyz"}

    def test_page_proves_the_answers_that_it_shows(self):
        scenes = {"room/right": (0, 1e-300, -1, -3), "box": (2, 1.5)}
        for name, places in scenes.items():
            self.view("room/left", name)
            for x in places:
                self.browser.js("hulldViewer.model.setPose(1, [0.6, 0, 0.8, 0, arguments[0], 0.1, 0], true)", x)
                self.browser.wait(AT_REST)
                self.assertIn("\u2713 Proven", self.browser.text("#proof"))
        # A forged answer is refuted.
        self.browser.js("""(() => {
          const {model} = hulldViewer;
          const forged = {...model.answer, relation: 'RELATION_SEPARATED',
                          certificate: {direction: {x: 1, y: 0, z: 0}, pairs: []}};
          hulldViewer.answer(forged);
        })()""")
        self.assertIn("refuted", self.browser.text("#proof"))
        self.assertIn("max n.A >= min n.B", self.browser.text("#proof"))


if __name__ == "__main__":
    viewer_case.main()
