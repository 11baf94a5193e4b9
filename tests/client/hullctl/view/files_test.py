"""Tests of files that the viewer reads and writes, in a real browser.

    /usr/bin/python3 files_test.py BIN_DIRECTORY [TEST...]
"""

import base64
import json
import os
import pathlib
import struct
import subprocess

import viewer_case
from viewer_case import AT_REST


class FilesTest(viewer_case.ViewerCase):
    def test_shown_files_are_not_stored_on_the_server(self):
        before = self.hulld.hullctl("list", "--output", "name")
        self.view("room/left", "/usr/share/assimp/models/OBJ/spider.obj")
        self.browser.wait("document.querySelector('#collision-count').textContent !== ''")
        self.browser.js("hulldViewer.model.select(0); hulldViewer.model.select(1, true)")
        self.assertEqual(self.hulld.hullctl("list", "--output", "name"), before)

    def test_a_killed_viewer_leaves_nothing_behind(self):
        viewer = self.hulld.view("/usr/share/assimp/models/OBJ/spider.obj")
        self.browser.open(viewer.address)
        folder = pathlib.Path(self.browser.js("hulldViewer.server").removeprefix("unix:")).parent
        self.assertTrue(folder.is_dir())
        self.browser.driver.get("about:blank")
        viewer.child.kill()
        viewer.child.communicate()
        # Bounded by the test's time limit only.
        while folder.exists():
            pass
        self.assertEqual(self.hulld.hullctl("list", "view/", "--output", "name"), "")

    def test_one_file_shows_everything_without_a_server(self):
        target = pathlib.Path(self.hulld.directory, "room.html")
        self.hulld.hullctl("view", "room/left", "room/right", "--html", str(target))
        self.browser.driver.get(target.as_uri())
        self.browser.wait("document.body.dataset.fitted")
        self.assertGreater(self.pixels()["drawn"], 0.03)
        self.browser.wait("document.querySelector('#relation').textContent.includes('separated')")
        self.assertAlmostEqual(float(self.browser.fact("separation")), 1)
        self.assertIn("\u2713 Proven", self.browser.text("#proof"))
        # It is not permitted to fetch anything, and requests nothing.
        self.assertEqual(self.browser.js("performance.getEntriesByType('resource')"
                                         ".filter(({name}) => !name.startsWith('data:')).length"), 0)
        self.assertNotRegex(target.read_text(), r"\bview/[0-9a-f]{12}/")

    def test_inline_shapes_of_a_scene_are_shown(self):
        corners = [x for p in range(8) for x in ((p & 1), (p >> 1 & 1), (p >> 2))]
        scene = {"placements": [{"hullId": "box"},
                                {"points": {"xyz": corners}, "pose": {"translation": {"x": 3}}}]}
        pathlib.Path(self.hulld.directory, "shapes.txt").write_text(json.dumps(scene))
        self.view("shapes.txt")
        self.browser.wait(AT_REST)
        self.assertAlmostEqual(float(self.browser.fact("separation")), 2)
        self.assertIn("\u2713 Proven", self.browser.text("#proof"))

    def test_only_the_pairs_that_a_scene_names_are_queried(self):
        place = "place: {left: {id: box}, middle: {id: box}, right: {id: box, at: [1, 0, 0]}}\n"
        rows = "[...document.querySelectorAll('#collisions .names')].map((row) => row.textContent)"
        for name, text, names in (
                ("all.yaml", place, ["left and middle", "left and right", "middle and right"]),
                ("named.yaml", place + "ask: {pairs: [[right, left]]}\n", ["left and right"])):
            pathlib.Path(self.hulld.directory, name).write_text(text)
            self.view(name)
            self.browser.wait(f"{rows}.length === arguments[0]", len(names))
            self.assertEqual(self.browser.js(rows), names)
        self.assertEqual(self.browser.js("hulldViewer.model.pair"), [0, 2])
        target = pathlib.Path(self.hulld.directory, "named.html")
        self.hulld.hullctl("view", "named.yaml", "--html", str(target))
        self.browser.driver.get(target.as_uri())
        self.browser.wait(f"{rows}.join() === 'left and right'")

    def test_a_scene_file_needs_no_server_of_its_own(self):
        pathlib.Path(self.hulld.directory, "cell.txt").write_text(
            "hulls: {leg: {box: [1, 1, 1]}}\nbodies: {stand: [{hull: leg}, {hull: leg, at: [2, 0, 0]}]}\n"
            "place: {here: {body: stand}, there: {hull: leg, at: [5, 0, 0]}}\n")
        target = pathlib.Path(self.hulld.directory, "cell.html")
        subprocess.run([self.hulld.programs / "hullctl", "view", "cell.txt", "--local", "--html",
                        str(target)], cwd=self.hulld.directory, check=True)
        self.browser.driver.get(target.as_uri())
        self.browser.wait("document.querySelector('#relation').textContent.includes('separated')")
        self.assertAlmostEqual(float(self.browser.fact("separation")), 2)

    def test_a_picture_without_a_window(self):
        target = pathlib.Path(self.hulld.directory, "room.png")
        said = self.hulld.hullctl("view", "room/left", "room/right", "--png", str(target),
                                  "--size", "1200x800")
        self.assertIn("1200 by 800 pixels", said)
        png = target.read_bytes()
        self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(struct.unpack(">II", png[16:24]), (1200, 800))
        # Shaded facets on a ground that reaches every corner, hence no panel.
        self.browser.driver.get("about:blank")
        colors = self.browser.driver.execute_async_script("""
          const [base64, done] = arguments;
          const image = new Image();
          image.onload = () => {
            const canvas = document.createElement('canvas');
            [canvas.width, canvas.height] = [image.width, image.height];
            const context = canvas.getContext('2d');
            context.drawImage(image, 0, 0);
            const {data} = context.getImageData(0, 0, image.width, image.height);
            const at = (x, y) => String(data.slice(4 * (y * image.width + x)).slice(0, 3));
            const all = new Set();
            for (let x = 0; x < image.width; ++x) all.add(at(x, image.height / 2));
            const [right, low] = [image.width - 2, image.height - 2];
            done({all: all.size, corners: [at(2, 2), at(right, 2), at(2, low), at(right, low)]});
          };
          image.src = 'data:image/png;base64,' + base64;""", base64.b64encode(png).decode())
        self.assertGreater(colors["all"], 20)
        self.assertEqual(len(set(colors["corners"])), 1)

    def test_a_picture_needs_a_browser(self):
        for name, words in (("no-such-browser", "is not an executable program"), ("/bin/false", "produced no picture")):
            refused = subprocess.run(
                [*self.hulld.command(), "view", "box", "--png", "box.png"], text=True,
                cwd=self.hulld.directory, capture_output=True,
                env={**os.environ, "HULLCTL_BROWSER": name})
            self.assertNotEqual(refused.returncode, 0)
            self.assertIn(words, refused.stderr)
        self.assertFalse(pathlib.Path(self.hulld.directory, "box.png").exists())


if __name__ == "__main__":
    viewer_case.main()
