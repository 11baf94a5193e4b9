"""Tests of motions in the viewer's page, in a real browser.

    /usr/bin/python3 motion_test.py BIN_DIRECTORY [TEST...]
"""

import json
import pathlib
import shlex

import viewer_case
from viewer_case import AT_REST

from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

#: The ball meets the wall after two thirds of its way, and passes the guest, which stays away.
SCENE = """place:
  wall: {id: box}
  ball: {id: box, at: [0, 6, 0], to: [0, 0, 0]}
  guest: {id: box, at: [9, 0, 0]}
"""


class MotionTest(viewer_case.ViewerCase):
    def scene(self, name, text):
        pathlib.Path(self.hulld.directory, name).write_text(text)
        return name

    def go_to(self, time):
        """Moves the slider as a user does, to its end."""
        self.browser.js("""(() => {
          const slider = document.querySelector('#moment');
          slider.value = arguments[0];
          slider.dispatchEvent(new Event('input'));
          slider.dispatchEvent(new Event('change'));
        })()""", time)

    def pose(self, index):
        return self.browser.js("hulldViewer.model.objects[arguments[0]].pose", index)

    def motion_fact(self, name):
        return float(self.browser.js("""[...document.querySelectorAll('#motion-facts dt')]
            .find((dt) => dt.textContent === arguments[0])
            .nextElementSibling.querySelector('[title]').title""", name))

    def assert_motion_as_api(self):
        """Asserts that the page agrees bit by bit with the command that it shows."""
        self.browser.wait("document.querySelector('#motion-command')")
        command = shlex.split(self.browser.text("#motion-command"))
        answer = self.hulld.json(*command[1:], server=self.browser.js("hulldViewer.server"))
        contact = answer["firstContact"]
        self.assertEqual(self.motion_fact("separated until"), contact["separatedUntil"])
        if "contactTime" in contact:
            self.assertEqual(self.motion_fact("first contact"), contact["contactTime"])
        else:
            self.assertIn("throughout", self.browser.text("#motion-relation"))
        self.assertIn("\u2713 Times proven", self.browser.text("#motion-proof"))
        return answer

    def test_a_slider_moves_the_object_and_its_first_contact_is_marked(self):
        self.view(self.scene("moving.yaml", SCENE))
        self.browser.wait("hulldViewer.model.pair?.join() === '0,1'")
        answer = self.assert_motion_as_api()
        self.assertEqual(answer["relation"], "RELATION_OVERLAPPING")
        time = answer["firstContact"]["contactTime"]
        self.assertAlmostEqual(time, 2 / 3)
        self.assertEqual(self.browser.js("[...document.querySelectorAll('#contacts span')]"
                                         ".map(({style}) => parseFloat(style.left))"),
                         [float(f"{100 * time:.4f}")])
        self.go_to(0.25)
        self.assertEqual(self.pose(1), [1, 0, 0, 0, 0, 4.5, 0])
        self.assertAlmostEqual(self.assert_answers_as_api()["separation"]["value"], 2.5)
        # The time is the server's, not the nearest step of the slider.
        self.browser.driver.find_element(By.ID, "contact").click()
        self.assertEqual(self.browser.js("hulldViewer.model.time"), time)
        self.assertEqual(self.pose(1)[5], (1 - time) * 6)
        self.assert_answers_as_api()
        # Only the motion moves it.
        self.assertTrue(self.browser.js("document.querySelector('#mode-move').disabled"))
        self.keys("x", "x")
        self.assertEqual(self.pose(1)[4], 0)

    def test_motions_play_to_their_end(self):
        self.view(self.scene("moving.yaml", SCENE))
        self.browser.driver.find_element(By.ID, "play").click()
        self.browser.wait("!hulldViewer.timeLine.playing && hulldViewer.model.time === 1")
        self.assertEqual(self.pose(1), [1, 0, 0, 0, 0, 0, 0])
        self.assertEqual(self.assert_answers_as_api()["relation"], "RELATION_OVERLAPPING")
        self.browser.wait("document.querySelector('#collision-count').textContent === '1 pair collides'")
        self.keys(",")
        self.assertAlmostEqual(self.browser.js("hulldViewer.model.time"), 2 / 3)

    def test_pairs_that_never_meet_are_separated_throughout(self):
        self.view(self.scene("moving.yaml", SCENE))
        self.browser.js("hulldViewer.model.select(2, 1)")
        self.assertEqual(self.assert_motion_as_api()["relation"], "RELATION_SEPARATED")
        self.assertTrue(self.browser.js("document.querySelector('#contact').hidden"))
        self.assertEqual(self.browser.js("document.querySelector('#contacts').childElementCount"), 0)
        self.browser.js("hulldViewer.model.select(2, 0)")
        self.assertIn("does not move", self.browser.text("#motion"))

    def test_the_first_contact_follows_a_dragged_obstacle(self):
        self.view(self.scene("moving.yaml", SCENE))
        self.assert_motion_as_api()
        self.browser.js("hulldViewer.model.select(0, 1)")
        field = self.browser.driver.find_element(By.CSS_SELECTOR, "[data-pose='5']")
        field.clear()
        field.send_keys("1", Keys.TAB)
        self.browser.wait("hulldViewer.model.pairMotion.firstContact.contactTime === 0.5")
        self.assertEqual(self.assert_motion_as_api()["firstContact"]["separatedUntil"], 0.5)
        # A hull that grows meets it earlier.
        self.hulld.add_box("tower")
        self.view(self.scene("grows.yaml", SCENE.replace("wall: {id: box}", "wall: {id: tower}")))
        self.assert_motion_as_api()
        self.hulld.add("tower", ["0 2 0"])
        self.browser.wait("hulldViewer.model.pairMotion.firstContact.contactTime === 0.5")

    def test_rotations_follow_the_quaternions_as_given(self):
        turn = {"placements": [
            {"hullId": "box", "pose": {"translation": {"x": 5}}},
            {"hullId": "box", "pose": {"rotation": {"w": 2, "x": 0, "y": 0, "z": 0}},
             "endPose": {"rotation": {"w": 0.25, "x": 0, "y": 0, "z": 0.5},
                         "translation": {"x": 4, "y": 0, "z": 0}}}]}
        self.view(self.scene("turn.json", json.dumps(turn)))
        self.assert_motion_as_api()
        self.go_to(0.5)
        self.assertEqual(self.pose(1), [1.125, 0, 0, 0.25, 2, 0, 0])
        self.assert_answers_as_api()
        # The swept shape encloses the object at each sampled time, up to the rounding of floats.
        self.assertLess(self.browser.js("""(() => {
          const {model, motion} = hulldViewer;
          const {surface, base} = motion.sweeps.known.get(model.objects[1]);
          const {array} = surface.attributes.position;
          let highest = [-Infinity, -Infinity, -Infinity];
          for (let i = 0; i < array.length; ++i)
            highest[i % 3] = Math.max(highest[i % 3], array[i] * model.unit + base[i % 3]);
          return Math.max(...[0, 0.5, 1].flatMap((t) => {
            model.setTime(t, true);
            return model.cornersOf(model.objects[1]).flatMap(
                (corner) => corner.map((value, k) => value - highest[k]));
          }));
        })()"""), 1e-5)

    def test_swept_shapes_are_drawn_and_can_be_hidden(self):
        self.view(self.scene("moving.yaml", SCENE))
        self.assert_motion_as_api()
        self.assertIn("not a proof", self.browser.text("#motion"))
        full = self.pixels()["drawn"]
        self.browser.driver.find_element(By.CSS_SELECTOR, "#sweep-choice span").click()
        self.assertLess(self.pixels()["drawn"], full)
        self.view("box")
        self.assertTrue(self.browser.js("document.querySelector('#sweep-choice').hidden"))
        self.assertEqual(self.browser.text("#motion"), "")

    def test_hulls_for_pictures_have_all_vertices_of_the_hulls(self):
        # Their faces are coplanar, and a quarter of the points is repeated.
        self.hulld.add("lattice", [f"{x} {y} {z + 0.5 * x}" for x in range(3) for y in range(3)
                                   for z in range(3)])
        self.view("lattice", "room/left", "/usr/share/assimp/models/OBJ/spider.obj")
        for index in range(3):
            volumes, is_closed = self.browser.driver.execute_async_script("""
              const [index, done] = arguments;
              import('hulld/drawing/convex_hull.js').then(({hullTriangles}) => {
                const {model} = hulldViewer;
                const shape = model.hullOf(model.objects[index]);
                const at = (i) => [...shape.xyz.subarray(3 * i, 3 * i + 3)];
                const points = Array.from({length: shape.vertexCount}, (_, i) => at(i));
                points.push(...points.slice(0, points.length / 4));
                const corners = hullTriangles(points);
                const edges = new Set();
                let volume = 0;
                for (let i = 0; i < corners.length; i += 3) {
                  const triangle = corners.slice(i, i + 3);
                  const [a, b, c] = triangle.map(
                      (corner) => points[corner].map((value, k) => value - shape.center[k]));
                  volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                             a[2] * (b[0] * c[1] - b[1] * c[0])) / 6;
                  triangle.forEach((from, k) => edges.add(`${from} ${triangle[(k + 1) % 3]}`));
                }
                const isClosed = [...edges].every(
                    (edge) => edges.has(edge.split(' ').reverse().join(' ')));
                done([[volume, shape.measures.volume], isClosed]);
              }).catch((error) => done([String(error), false]));""", index)
            self.assertTrue(is_closed)
            self.assertAlmostEqual(volumes[0] / volumes[1], 1, delta=1e-9)

    def test_a_file_plays_the_motion_with_its_proofs(self):
        target = pathlib.Path(self.hulld.directory, "moving.html")
        self.scene("moving.yaml", SCENE)
        self.hulld.hullctl("view", "moving.yaml", "--html", str(target))
        self.browser.driver.get(target.as_uri())
        self.browser.wait("document.body.dataset.fitted")
        self.browser.wait("hulldViewer.model.pair?.join() === '0,1'")
        for time, relation in ((0, "separated"), (0.25, "separated"), (0.65625, "separated"),
                               (0.671875, "overlapping"), (1, "overlapping")):
            self.go_to(time)
            self.assertIn(relation, self.browser.text("#relation"))
            self.assertIn("\u2713 Proven", self.browser.text("#proof"))
        self.browser.driver.find_element(By.ID, "contact").click()
        self.assertEqual(self.browser.js("hulldViewer.model.time"), self.motion_fact("first contact"))
        self.assertIn("\u2713 Proven", self.browser.text("#proof"))
        self.browser.driver.find_element(By.ID, "play").click()
        self.browser.wait("!hulldViewer.timeLine.playing && hulldViewer.model.time === 1")
        self.browser.js("hulldViewer.model.select(2, 1)")
        self.assertIn("throughout", self.browser.text("#motion-relation"))
        self.assertIn("\u2713 Times proven", self.browser.text("#motion-proof"))

    def test_a_forged_motion_is_refuted(self):
        self.view(self.scene("moving.yaml", SCENE))
        self.assert_motion_as_api()
        self.browser.js("""(() => {
          const {model, motion} = hulldViewer;
          motion.arrived({...model.motion, firstContact: {
            ...model.motion.firstContact, contactTime: 0.75, separatedUntil: 0.75}});
        })()""")
        self.assertIn("refuted", self.browser.text("#motion-proof"))
        self.assertIn("before separated_until, 0.75", self.browser.text("#motion-proof"))

    def test_motions_of_bodies_are_proven(self):
        self.hulld.hullctl("body", "put", "pair", "box@0,0,2:0.25", "box@0,0,-2")
        self.view(self.scene("bodies.yaml", SCENE.replace("ball: {id: box", "ball: {id: pair")))
        self.assert_motion_as_api()
        self.assertEqual(self.browser.js("hulldViewer.model.pairMotion.pieceCertificates.length"), 2)


if __name__ == "__main__":
    viewer_case.main()
