"""The base class of the tests of the viewer's page in a real browser."""

import shlex
import unittest

import viewing

viewing.skip_unless_browser()

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By

#: JavaScript: the page shows the answer to its latest query.
AT_REST = "hulldViewer.model.answer?.rest && hulldViewer.model.answer.update === hulldViewer.update"


class ViewerCase(unittest.TestCase):
    """One server and one browser for all tests; each test has its own viewer."""

    programs = None  # The folder of hulld and hullctl; set by main().

    @classmethod
    def setUpClass(cls):
        cls.hulld = viewing.Hulld(cls.programs)
        cls.browser = viewing.Browser()
        cls.hulld.add_box("box")
        cls.hulld.add_box("room/left")
        cls.hulld.add_box("room/right", low=(2.0, 0.0, 0.0))

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        cls.hulld.stop()

    def setUp(self):
        # Small, because the processor computes every pixel.
        self.browser.resize(960, 600)
        self.browser.problems()

    def tearDown(self):
        self.assertEqual(self.browser.problems(), [])

    def view(self, *arguments):
        """Opens `hullctl view ARGUMENTS` in the browser."""
        viewer = self.hulld.view(*arguments)

        def leave():
            # The page would report that hullctl has ended.
            self.browser.driver.get("about:blank")
            self.assertEqual(viewer.stop(), 0, viewer.said)

        self.addCleanup(leave)
        self.browser.open(viewer.address)
        return viewer

    def canvas(self):
        return self.browser.driver.find_element(By.ID, "canvas")

    def count_pixels(self, key, result):
        """Renders a frame and returns `result`, an expression of `counts` and `total`.

        counts: from the value of `key`, an expression of [r, g, b], to its number of pixels.
        """
        self.browser.wait("!hulldViewer.stage.waiting")
        return self.browser.js(f"""(() => {{
          const {{stage}} = hulldViewer;
          const gl = stage.renderer.getContext();
          const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
          const total = w * h;
          const data = new Uint8Array(4 * total);
          stage.renderer.render(stage.scene, stage.camera);
          gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, data);
          const counts = new Map();
          for (let i = 0; i < data.length; i += 4) {{
            const [r, g, b] = data.subarray(i, i + 3);
            counts.set({key}, (counts.get({key}) || 0) + 1);
          }}
          return {result};
        }})()""")

    def pixels(self):
        """Returns the number of colors of the canvas, and the part that is not ground."""
        return self.count_pixels(
            "r << 16 | g << 8 | b",
            "{colors: counts.size, drawn: 1 - Math.max(...counts.values()) / total}")

    def keys(self, *keys):
        ActionChains(self.browser.driver).send_keys(*keys).perform()

    def assert_answers_as_api(self):
        """Asserts that the page at rest agrees bit by bit with the command that it shows."""
        self.browser.wait(AT_REST)
        command = shlex.split(self.browser.text("#command"))
        self.assertEqual(command[:2], ["hullctl", "check"])
        answer = self.hulld.json(*command[1:], server=self.browser.js("hulldViewer.server"))
        words = {"RELATION_SEPARATED": "separated", "RELATION_TOUCHING": "touching",
                 "RELATION_OVERLAPPING": "overlapping"}
        self.assertIn(words[answer["relation"]], self.browser.text("#relation"))
        fact = self.browser.fact
        self.assertEqual(float(fact("separation")), answer["separation"]["value"])
        self.assertEqual(float(fact("within")), answer["separation"]["bound"])
        for name, point in (("point of A", "pointA"), ("point of B", "pointB")):
            self.assertEqual([float(x) for x in fact(name).split()],
                             [answer["witness"][point][k] for k in "xyz"])
        if answer.get("axis"):
            self.assertEqual([float(x) for x in fact("axis").split()],
                             [answer["axis"]["direction"][k] for k in "xyz"])
        self.assertEqual(fact("revisions"),
                         f"{answer['hullA']['revision']} and {answer['hullB']['revision']}")
        return answer

    def drag_handle(self, right, up):
        """Drags the handle of the plane that faces us by pixels, in several steps."""
        x, y = self.browser.wait("""(() => {
          const {stage, gizmo} = hulldViewer;
          return stage.toScreen(gizmo.proxy.position.clone());
        })()""")
        width, height = self.browser.js(
            "[hulldViewer.stage.canvas.clientWidth, hulldViewer.stage.canvas.clientHeight]")
        chain = ActionChains(self.browser.driver)
        chain.move_to_element_with_offset(self.canvas(), round(x - width / 2), round(y - height / 2))
        chain.click_and_hold()
        for _ in range(5):
            chain.move_by_offset(right // 5, -up // 5)
        chain.release().perform()


def main():
    """Runs the tests of the calling file: FILE BIN_DIRECTORY [TEST...]."""
    ViewerCase.programs = viewing.bin_directory()
    unittest.main(verbosity=2)
