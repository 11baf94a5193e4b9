"""Tests of recorded watches in the viewer's page, in a real browser.

    /usr/bin/python3 watch_test.py BIN_DIRECTORY [TEST...]
"""

import json
import pathlib
import subprocess

import viewer_case

SCENE = """place:
  still: {id: grows}
  near: {id: box, at: [4, 0, 0]}
  far: {id: box, at: [6, 0, 0]}
"""


class WatchTest(viewer_case.ViewerCase):
    def file(self, name, text):
        pathlib.Path(self.hulld.directory, name).write_text(text)
        return name

    def record(self, last, changes, *watched):
        """Returns the output of a watch up to the event `last`. Each change follows the events of
        the one before."""
        watch = subprocess.Popen([*self.hulld.command(), "watch", *watched, "--output", "json"],
                                 cwd=self.hulld.directory, stdout=subprocess.PIPE, text=True)
        lines = []
        is_synced = False
        for line in watch.stdout:
            lines.append(line)
            message = json.loads(line)
            if last in line:
                break
            if changes and message["events" if is_synced else "synced"]:
                is_synced = True
                changes.pop(0)()
        watch.terminate()
        watch.communicate()
        return "".join(lines)

    def go_to(self, moment):
        self.browser.js("hulldViewer.timeLine.jumpTo(arguments[0])", moment)

    def pairs(self):
        return self.browser.js("hulldViewer.model.collisions.pairs.map((pair) => pair.join(' '))")

    def marks(self):
        return self.browser.js("[...document.querySelectorAll('#contacts span')].map("
                               "({style}) => [parseFloat(style.left), parseFloat(style.width)])")

    def record_growth(self):
        self.hulld.hullctl("delete", "grows", "--if-exists")
        self.hulld.add_box("grows")
        # It reaches the near box, overlaps it, and is deleted. The two boxes touch throughout.
        changes = [lambda: self.hulld.add("grows", ["3 0 0"]),
                   lambda: self.hulld.add("grows", ["3.5 0 0"]),
                   lambda: self.hulld.hullctl("delete", "grows")]
        return self.record("KIND_LOST", changes, "--scene", self.file("scene.yaml", SCENE))

    def test_a_watch_of_a_scene_shows_the_pairs_over_time(self):
        recording = self.file("watch.jsonl", self.record_growth())
        self.hulld.add_box("grows")
        self.view("scene.yaml", "--recording", recording)
        boxes = "1 2 RELATION_TOUCHING"
        expected = [[boxes], [boxes, "0 1 RELATION_TOUCHING"], [boxes, "0 1 RELATION_OVERLAPPING"],
                    [boxes]]
        self.assertEqual(self.pairs(), expected[0])
        self.assertEqual(self.browser.js("hulldViewer.timeLine.track.last"), 3)
        for moment in (1, 2, 3, 1, 0):
            self.go_to(moment)
            self.assertEqual(self.pairs(), expected[moment])
        self.assertEqual(self.marks(), [[0, 100]])
        self.assertIn("revision", self.browser.text("#moment-text"))
        # The server's answer about the current pairs changes nothing here.
        self.go_to(2)
        self.browser.js("hulldViewer.ask(true)")
        self.browser.wait(viewer_case.AT_REST)
        self.assertEqual(self.pairs(), expected[2])
        self.assertIn("2 pairs collide", self.browser.text("#collision-count"))
        # Objects stay at their watched poses.
        self.assertTrue(self.browser.js("document.querySelector('#mode-move').disabled"))
        self.browser.js("document.querySelector('#play').click()")
        self.browser.wait("!hulldViewer.timeLine.playing && hulldViewer.timeLine.slider.value === '3'")
        self.assertEqual(self.pairs(), expected[3])

    def test_a_file_plays_a_recorded_watch(self):
        recording = self.file("watch.jsonl", self.record_growth())
        self.hulld.add_box("grows")
        target = pathlib.Path(self.hulld.directory, "watch.html")
        self.hulld.hullctl("view", "scene.yaml", "--recording", recording, "--html", str(target))
        self.browser.driver.get(target.as_uri())
        self.browser.wait("document.body.dataset.fitted")
        self.assertEqual(len(self.pairs()), 1)
        self.go_to(2)
        self.assertEqual(len(self.pairs()), 2)

    def test_a_watch_of_hulls_shows_which_existed(self):
        self.hulld.add_box("live/a")
        changes = [lambda: self.hulld.add_box("live/b", low=(3, 0, 0)),
                   lambda: self.hulld.hullctl("delete", "live/a")]
        recording = self.file("hulls.jsonl", self.record("KIND_DELETED", changes, "live/"))
        self.hulld.add_box("live/a")
        self.view("live/", "--recording", recording)
        gone = "hulldViewer.model.objects.map(({gone}) => gone)"
        self.assertEqual(self.browser.js(gone), [False, True])
        self.go_to(1)
        self.assertEqual(self.browser.js(gone), [False, False])
        self.go_to(self.browser.js("hulldViewer.timeLine.track.last"))
        self.assertEqual(self.browser.js(gone), [True, False])
        self.assertIn("1 object", self.browser.text("#status"))

    def test_recordings_that_do_not_fit_are_refused(self):
        recording = self.file("watch.jsonl", self.record_growth())
        self.hulld.add_box("grows")
        self.file("short.yaml", "place: {still: {id: grows}, near: {id: box}}")
        self.file("empty.jsonl", "")
        self.file("broken.jsonl", '{"events": 3}\n')
        for arguments, complaint in (
                (["box", "--recording", recording], "records a watch of a scene; pass the scene file"),
                (["short.yaml", "--recording", recording], "placement 2, counted from 0, but short.yaml has only 2"),
                (["--demo", "--recording", recording], "cannot be combined with --demo"),
                (["box", "--recording", "empty.jsonl"], "contains no event"),
                (["box", "--recording", "broken.jsonl"], "broken.jsonl:1: not a line of"),
                (["box", "--recording", "absent.jsonl"], "absent.jsonl")):
            ran = subprocess.run([*self.hulld.command(), "view", "--no-open", *arguments], text=True,
                                 cwd=self.hulld.directory, capture_output=True)
            self.assertEqual(ran.returncode, 2, ran.stderr)
            self.assertIn(complaint, ran.stderr)


if __name__ == "__main__":
    viewer_case.main()
