"""Tests of robots in the viewer's page, in a real browser.

    /usr/bin/python3 robot_test.py BIN_DIRECTORY [TEST...]
"""

import pathlib
import subprocess

import viewer_case
from viewer_case import AT_REST

from selenium.webdriver.common.by import By

URDF = """<robot name="arm">
  <link name="base"><collision><geometry><box size="2 2 2"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="rod"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="8"/></joint>
  <link name="rod"><collision><origin xyz="2 0 0"/>
    <geometry><box size="0.5 0.5 0.5"/></geometry></collision></link>
  <joint name="lift" type="prismatic"><parent link="rod"/><child link="hand"/>
    <axis xyz="0 0 1"/><limit lower="-4" upper="4"/></joint>
  <link name="hand"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
</robot>
"""
#: The hand touches the base at slide = 1.5.
PATH = "slide,lift\n4,0\n3,0\n1.5,0\n1,0\n1,3\n"


class RobotTest(viewer_case.ViewerCase):
    def setUp(self):
        super().setUp()
        for name, text in (("arm.urdf", URDF), ("path.csv", PATH)):
            pathlib.Path(self.hulld.directory, name).write_text(text)

    def slide(self, selector, value):
        """Moves a slider as a user does, to its end."""
        self.browser.js("""(() => {
          const slider = document.querySelector(arguments[0]);
          slider.value = arguments[1];
          slider.dispatchEvent(new Event('input'));
          slider.dispatchEvent(new Event('change'));
        })()""", selector, value)

    def place(self, index):
        return self.browser.js("hulldViewer.model.objects[arguments[0]].pose.slice(4)", index)

    def test_joints_move_the_links_and_answers_follow(self):
        self.view("arm.urdf")
        self.assertEqual(self.browser.js("hulldViewer.stage.camera.up.toArray()"), [0, 0, 1])
        self.assertTrue(self.browser.js("document.querySelector('#time').hidden"))
        # At rest, the hand is within the base; the rod is adjacent to both.
        self.browser.wait("hulldViewer.model.pair?.join() === '0,2'")
        self.slide("[aria-label='Joint slide']", 4)
        self.browser.wait("hulldViewer.model.objects[2].pose[4] === 4")
        self.assertEqual(self.place(1), [6, 0, 0])
        answer = self.assert_answers_as_api()
        self.assertAlmostEqual(answer["separation"]["value"], 2.5)
        # Only joints move links.
        self.assertTrue(self.browser.js("document.querySelector('#mode-move').disabled"))
        self.keys("x", "x")
        self.assertEqual(self.place(2), [4, 0, 0])

    def test_a_trajectory_plays_and_marks_contacts(self):
        self.view("arm.urdf", "--joints", "path.csv")
        self.assertEqual(self.place(2), [4, 0, 0])
        # Waypoints 3 and 4 of 5.
        self.assertEqual(self.browser.js(
            "[...document.querySelectorAll('#contacts span')].map(({style}) => "
            "[style.left, style.width])"), [["50%", "25%"]])
        self.slide("#moment", 1.5)
        self.browser.wait("hulldViewer.model.objects[2].pose[4] === 2.25")
        self.assertEqual(self.browser.text("#moment-text"), "2.5 of 5")
        self.assertEqual(float(self.browser.js(
            "document.querySelector(\"[aria-label='Joint slide']\").value")), 2.248)
        self.slide("#moment", 2)
        self.browser.wait("hulldViewer.model.pair?.join() === '0,2'")
        self.assertEqual(self.assert_answers_as_api()["relation"], "RELATION_TOUCHING")
        self.browser.driver.find_element(By.ID, "play").click()
        self.browser.wait("!hulldViewer.timeLine.playing && hulldViewer.model.objects[2].pose[6] === 3")
        self.assertEqual(self.browser.text("#moment-text"), "5 of 5")
        self.assertEqual(self.assert_answers_as_api()["relation"], "RELATION_SEPARATED")

    def test_a_file_plays_the_trajectory_with_its_proofs(self):
        target = pathlib.Path(self.hulld.directory, "arm.html")
        self.hulld.hullctl("view", "arm.urdf", "--joints", "path.csv", "--html", str(target))
        self.browser.driver.get(target.as_uri())
        self.browser.wait("document.body.dataset.fitted")
        self.assertIn("To move the joints, run hullctl view without --html.",
                      self.browser.text("#joints"))
        self.browser.js("hulldViewer.model.select(2, 0)")
        for waypoint, relation in enumerate(["separated", "separated", "touching", "overlapping"]):
            self.slide("#moment", waypoint)
            self.browser.wait(f"document.querySelector('#relation').textContent.includes('{relation}')")
            self.assertIn("\u2713 Proven", self.browser.text("#proof"))
        self.assertEqual(self.place(2), [1, 0, 0])
        self.browser.driver.find_element(By.ID, "play").click()
        self.browser.wait("!hulldViewer.timeLine.playing && hulldViewer.model.objects[2].pose[6] === 3")

    def test_the_page_of_the_guide_proves_its_answers(self):
        page = pathlib.Path(__file__).resolve().parents[4] / "client/pictures/arm.html"
        self.browser.driver.get(page.as_uri())
        self.browser.wait("document.body.dataset.fitted")
        self.browser.js("hulldViewer.model.select(2, 0)")
        relations = set()
        for waypoint in range(self.browser.js("hulldViewer.model.waypoints.length")):
            self.slide("#moment", waypoint)
            self.assertIn("\u2713 Proven", self.browser.text("#proof"), waypoint)
            relations.add(self.browser.text("#relation").split()[-1])
        self.assertEqual(relations, {"separated", "overlapping"})

    def test_a_robot_is_shown_in_its_surroundings(self):
        pathlib.Path(self.hulld.directory, "cell.yaml").write_text(
            "prefix: cell/\nhulls: {post: {box: [1, 1, 1]}}\n"
            "place: {post: {hull: post, at: [4, 0, 2]}, lamp: {hull: post, at: [4, 0, 2.9]},\n"
            "        floor: {hull: post, at: [0, 0, 0]}}\n")
        self.hulld.hullctl("scene", "apply", "cell.yaml")
        self.addCleanup(self.hulld.hullctl, "scene", "delete", "cell.yaml", "--yes")
        self.view("arm.urdf", "--joints", "path.csv", "--scene", "cell.yaml", "--ignore", "base,floor")
        self.assertEqual(self.browser.js("hulldViewer.model.objects.map(({name}) => name)"),
                         ["base", "rod", "hand", "post", "lamp", "floor"])
        # Post and lamp overlap, as do floor and base; neither pair is queried.
        self.browser.wait("document.querySelector('#collision-count').textContent === 'No pair collides'")
        self.slide("[aria-label='Joint lift']", 1.5)
        self.browser.wait("hulldViewer.model.collisions.pairs.join() === '2,3,RELATION_OVERLAPPING'")
        self.browser.js("hulldViewer.model.select(3, 2)")
        # Up to a step of the slider.
        separation = self.assert_answers_as_api()["separation"]["value"]
        self.assertAlmostEqual(separation, -0.5, delta=0.01)
        # The surroundings can be dragged.
        self.assertFalse(self.browser.js("document.querySelector('#mode-move').disabled"))
        target = pathlib.Path(self.hulld.directory, "cell.html")
        subprocess.run([self.hulld.programs / "hullctl", "view", "arm.urdf", "--local", "--scene",
                        "cell.yaml", "--html", str(target)], cwd=self.hulld.directory, check=True)
        self.browser.driver.get(target.as_uri())
        self.browser.wait("document.querySelector('#collision-count').textContent === '3 pairs collide'")

    def test_wrong_uses_are_refused(self):
        pathlib.Path(self.hulld.directory, "moving.yaml").write_text(
            "place: {cart: {id: box, at: [9, 0, 0], to: [5, 0, 0]}}\n")
        for arguments, words in (
                (["box", "--scene", "moving.yaml"], "--scene needs --demo, or a robot"),
                (["arm.urdf", "--scene", "moving.yaml"], "cart moves"),
                (["--demo", "--scene", "8"], "is not a demo scene"),
                (["box", "--ignore", "a,b"], "apply to a robot"),
                (["arm.urdf", "box"], "arm.urdf is a robot; it cannot be combined"),
                (["box", "--joints", "path.csv"], "apply to a robot"),
                (["arm.urdf", "--joints", "none.csv"], "none.csv")):
            refused = subprocess.run([*self.hulld.command(), "view", *arguments], text=True,
                                     cwd=self.hulld.directory, capture_output=True)
            self.assertNotEqual(refused.returncode, 0)
            self.assertIn(words, refused.stderr)


if __name__ == "__main__":
    viewer_case.main()
