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
        def numbers(pose):
            rotation = pose.get("rotation", {"w": 1})
            return ([rotation.get(k, 0) for k in "wxyz"] +
                    [pose.get("translation", {}).get(k, 0) for k in "xyz"])

        sides = []
        for side in (request["a"], request["b"]):
            start = side.get("pose", {})
            sides.append({"id": side["hullId"], "radius": side.get("radius", 0),
                          "start": numbers(start), "end": numbers(side.get("endPose", start))})
        return self.browser.driver.execute_async_script("""
          const [response, given, done] = arguments;
          const {relation, certificate = {}, firstContact, pieceCertificates = []} = response;
          const {model} = hulldViewer;
          const sides = given.map(({id, radius, start, end}) =>
              (model.bodies.get(id)?.pieces ?? [{hullId: id}]).map((piece) => ({
                xyz: model.hulls.get(piece.hullId).xyz,
                poses: [start, piece.pose].filter(Boolean), end,
                radii: [radius, piece.radius ?? 0]})));
          Promise.all([import('hulld/proof/certificate.js'),
                       import('hulld/proof/motion_certificate.js')]).then(
              ([{certificateProblem}, {motionProblem, bodiesMotionProblem}]) => done(
                  !firstContact ? certificateProblem(relation, certificate, ...sides.flat()) :
                  pieceCertificates.length ?
                      bodiesMotionProblem(relation, firstContact, pieceCertificates, ...sides) :
                      motionProblem(relation, firstContact, certificate, ...sides.flat()))
          ).catch((error) => done(String(error)));""", response, sides)

    def hullctl_verdict(self, record):
        target = pathlib.Path(self.hulld.directory, "judged.json")
        target.write_text(json.dumps(record))
        said = subprocess.run([*self.hulld.command(), "verify", str(target), "--output", "json"],
                              text=True, capture_output=True).stdout
        verdict = json.loads(said)
        # The page shows the bracket of a contact, and does not check its width.
        is_proven = verdict["verdict"] == "VALID" or "which are more than" in verdict["reason"]
        return "" if is_proven else verdict["reason"]

    def test_page_and_hullctl_agree_on_certificates(self):
        random = Random(20)
        for name, count in (("proof/a", 12), ("proof/b", 30)):
            self.hulld.add(name, [" ".join(repr(random.gauss(0, 1)) for _ in range(3))
                                  for _ in range(count)])
        self.view("proof/a", "proof/b", "room/left", "room/right")
        record = pathlib.Path(self.hulld.directory, "record.json")
        queries = [("proof/a", "proof/b", [random.gauss(0, 1) for _ in range(4)] +
                      [random.gauss(0, far) for _ in range(3)], radius)
                     for far in (0.5, 0.5, 2, 4, 1e9) for radius in (0, 0.75)]
        # They share a face, an edge, or a corner; then they are 1.5 apart or 2.5.
        queries += [("room/left", "room/right", [1, 0, 0, 0, *t], radius)
                      for t, radius in (((-1, 0.3, 0), 0), ((-1, 1, 0), 0), ((-1, 1, -3), 0),
                                        ((0.5, 0.3, 0), 0.75), ((0.5, 3, 0), 1.25))]
        proven = refuted = 0
        relations = set()
        for a, b, pose, radius in queries:
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

    def test_page_and_hullctl_agree_on_motions(self):
        random = Random(31)
        self.hulld.add("rod", ["0 0 0", "5 0 0"])
        self.hulld.add("ceiling", [f"{x} {y} {z}" for x in (0, 6) for y in (4, 5) for z in (-1, 1)])
        self.hulld.hullctl("body", "put", "table", "rod@0,0,-4", "box@1,0,0,1,0,0,0:0.25")
        self.view("rod", "ceiling", "box", "room/right", "table")
        record = pathlib.Path(self.hulld.directory, "motion.json")
        turn = "1,0,0,0,0,0,0 --to-a 1,0,0,1,0,0,0"
        queries = [
            # The tip of the rod meets the ceiling at half time, or passes 1/8 below it.
            ("rod", "ceiling", f"--pose-a {turn}"),
            ("rod", "ceiling", f"--pose-a {turn} --radius-b 0.125"),
            ("rod", "ceiling", f"--pose-a {turn} --pose-b 0,1.125,0"),
            # Translations: at a time that is a double, at one that is not, a graze, and never.
            ("box", "box", "--pose-a 4,0,0 --to-a 0,0,0"),
            ("box", "box", "--pose-a 5,0.5,0 --to-a -1,0,0"),
            ("box", "box", "--pose-a 4,2,0 --to-a -4,2,0"),
            ("box", "box", "--pose-a 4,2.5,0 --to-a -4,2.5,0"),
            ("box", "box", "--pose-a 6,8,0 --to-a 3,4,0 --radius-a 1 --radius-b 0.5"),
            ("box", "box", "--pose-a 9,9,9 --to-a 7,9,9"),
            ("table", "box", "--pose-a 6,0,0 --to-a 0,0,0"),
            ("table", "box", "--pose-a 6,0,0 --to-a 0.6,0,0,0.8,4,0,0"),
            ("table", "room/right", f"--pose-a {turn}"),
        ]
        for _ in range(6):
            poses = [",".join(repr(random.gauss(0, 1)) for _ in range(4)) + "," +
                     ",".join(repr(random.gauss(0, far)) for _ in range(3)) for far in (4, 2)]
            queries.append(("box", "room/right", f"--pose-a {poses[0]} --to-a {poses[1]}"))
        verdicts = {"": 0}
        relations = set()
        for a, b, options in queries:
            self.hulld.hullctl("check", a, b, "--certificate", "--record", str(record),
                               *options.split())
            honest = json.loads(record.read_text())
            relations.add(honest["response"]["relation"])
            for forge in (lambda r: None, self.swap_relation, self.bend_direction, self.drop_pair,
                          self.move_index, self.move_vertex, self.bend_plane, self.shift_plane,
                          self.drop_interval, self.stretch_interval, self.delay_contact,
                          self.deny_contact, self.drop_piece):
                forged = json.loads(record.read_text())
                forge(forged["response"])
                said = self.page_verdict(forged["response"], honest["request"])
                # The times of messages may have fewer digits there.
                self.assertEqual(said.lower(), self.hullctl_verdict(forged).lower(),
                                 (options, forge, forged["response"]))
                verdicts[said] = verdicts.get(said, 0) + 1
            self.assertEqual(self.page_verdict(honest["response"], honest["request"]), "", options)
        self.assertEqual(len(relations), 3)
        self.assertGreater(len(verdicts), 12)

    @staticmethod
    def proofs(response):
        """The objects with intervals: the first contact, or the pairs of pieces."""
        return response.get("pieceCertificates") or [response["firstContact"]]

    def bend_plane(self, response):
        for proof in self.proofs(response):
            for interval in proof["intervals"][:1]:
                direction = interval.get("direction")
                if direction:
                    direction["x"], direction["y"] = direction["y"], -direction["x"]

    def shift_plane(self, response):
        for proof in self.proofs(response):
            for interval in proof["intervals"][-1:]:
                interval["offset"] = interval.get("offset", 0) + 3

    def drop_interval(self, response):
        self.proofs(response)[-1]["intervals"][-1:] = []

    def stretch_interval(self, response):
        for proof in self.proofs(response):
            if len(proof["intervals"]) > 1:
                proof["intervals"][0]["until"] = proof["intervals"][1]["until"]
            elif proof["intervals"]:
                proof["intervals"][0]["until"] /= 2

    @staticmethod
    def delay_contact(response):
        contact = response["firstContact"]
        for name in ("separatedUntil", "contactTime"):
            if name in contact:
                contact[name] = min(1, contact[name] + 0.0625)

    @staticmethod
    def deny_contact(response):
        response["relation"] = "RELATION_SEPARATED"
        response["firstContact"].pop("contactTime", None)

    @staticmethod
    def drop_piece(response):
        response["pieceCertificates"][:1] = []

    def test_planes_may_move(self):
        # A rod turns by a quarter below a ceiling; a plane between them rises.
        self.hulld.add("clock", ["0 0 0", "1 0 0"])
        self.hulld.add("lid", [f"{x} {y} 0" for x in (-9, 9) for y in (1.25, 2)])
        self.view("clock", "lid")
        request = {"a": {"hullId": "clock",
                         "endPose": {"rotation": {"w": 1, "x": 0, "y": 0, "z": 1}}},
                   "b": {"hullId": "lid"}}
        interval = {"until": 1, "direction": {"x": -0.25, "y": 1, "z": 0}, "offset": 1,
                    "endDirection": {"x": 0, "y": 1, "z": 0}, "endOffset": 1.125}
        response = {"relation": "RELATION_SEPARATED",
                    "firstContact": {"separatedUntil": 1, "intervals": [interval]}}
        self.assertIn("B does not stay", self.page_verdict(response, request))
        interval["direction"]["x"] = 0
        self.assertEqual(self.page_verdict(response, request), "")
        interval["endOffset"] = 0.75
        self.assertIn("A does not stay", self.page_verdict(response, request))
        del interval["endDirection"]
        self.assertIn("the end of a plane needs", self.page_verdict(response, request))

    @staticmethod
    def swap_relation(response):
        response["relation"] = {"RELATION_SEPARATED": "RELATION_TOUCHING",
                                "RELATION_TOUCHING": "RELATION_OVERLAPPING",
                                "RELATION_OVERLAPPING": "RELATION_SEPARATED"}[response["relation"]]

    @staticmethod
    def bend_direction(response):
        direction = response.get("certificate", {}).get("direction")
        if direction:
            direction["x"], direction["y"] = direction["y"], -direction["x"]

    @staticmethod
    def drop_pair(response):
        response.get("certificate", {}).get("pairs", [])[-1:] = []

    @staticmethod
    def move_index(response):
        for pair in response.get("certificate", {}).get("pairs", [])[:1]:
            pair["indexA"] = pair.get("indexA", 0) + 40

    @staticmethod
    def move_vertex(response):
        for pair in response.get("certificate", {}).get("pairs", [])[:1]:
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
