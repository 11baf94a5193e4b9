"""Tests of the picture and the tools of the viewer's page, in a real browser.

    /usr/bin/python3 picture_test.py BIN_DIRECTORY [TEST...]
"""

import ast
import base64
import json
import pathlib
import shlex
import struct

import viewer_case
from viewer_case import AT_REST

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys


class PictureTest(viewer_case.ViewerCase):
    # --- The picture ---

    def test_faces_of_a_cube_differ(self):
        self.view("box")
        for theme in ("light", "dark"):
            self.browser.js("(() => { const {model} = hulldViewer; hulldViewer.setTheme(arguments[0]);"
                            " model.show = {...model.show, edges: false, labels: false, grid: false};"
                            " model.select(null); model.tell('shown'); })()", theme)
            # The ground and three faces: each has a single color, each with a different brightness.
            shades = sorted(self.count_pixels(
                "r + g + b",
                "[...counts].filter(([, count]) => count > 0.01 * total).map(([sum]) => sum)"))
            self.assertEqual(len(shades), 4, theme)
            self.assertGreater(min(b - a for a, b in zip(shades, shades[1:])), 40, (theme, shades))

    def test_scenes_of_any_size_and_place_are_drawn(self):
        def draw(size, at):
            cube = {"xyz": [size * v for x in (0, 1) for y in (0, 1) for z in (0, 1)
                            for v in (x, y, z)]}
            pathlib.Path(self.hulld.directory, "size.json").write_text(json.dumps(
                {"placements": [{"points": cube, "pose": {"translation": {"x": x}}}
                                for x in (at, at + 1.5 * size)]}))
            self.view("size.json")
            self.browser.wait(AT_REST)
            self.browser.js("(hulldViewer.model.show.edges = false, hulldViewer.model.select(null))")
            black = self.count_pixels("r + g + b < 60", "(counts.get(true) ?? 0) / total")
            self.assertLess(black, 0.002, (size, at))
            # A click in the middle of the first cube.
            self.assertEqual(self.browser.js("""(({model, stage}) => {
              const [x, y] = stage.toScreen(stage.local(model.centerOf(model.objects[0])));
              const {left, top} = stage.canvas.getBoundingClientRect();
              const at = {clientX: left + x, clientY: top + y, pointerId: 1};
              for (const type of ['pointerdown', 'pointerup'])
                stage.canvas.dispatchEvent(new PointerEvent(type, at));
              return model.selected;
            })(hulldViewer)"""), 0, (size, at))
            return self.pixels()["drawn"]

        usual = draw(1, 0)
        self.assertGreater(usual, 0.05)
        for size in (1e-300, 1e-30, 1e-9, 1e13, 1e30, 1e300):
            self.assertAlmostEqual(draw(size, 0), usual, delta=0.02, msg=size)
        # Further apart than neighboring lines of the grid are neighboring doubles.
        self.assertGreater(draw(1, 1e20), 0.05)

    def test_the_picture_returns_after_the_browser_lost_it(self):
        self.view("box")
        self.browser.wait("!hulldViewer.stage.waiting")
        before = self.pixels()["drawn"]
        self.browser.js("(globalThis.loss = hulldViewer.stage.renderer.getContext()"
                        ".getExtension('WEBGL_lose_context')).loseContext()")
        self.browser.wait("!document.querySelector('#message').hidden")
        frames = self.browser.js("hulldViewer.stage.frames")
        self.browser.js("globalThis.loss.restoreContext()")
        self.browser.wait("hulldViewer.stage.frames > arguments[0]", frames)
        self.assertAlmostEqual(self.pixels()["drawn"], before, delta=0.01)
        self.browser.problems()

    def test_a_zoomed_page_draws_at_the_resolution_of_the_screen(self):
        self.view("box")
        self.browser.js("(hulldViewer.stage.antialias = true)")
        for ratio in (2, 1):
            self.browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
                "width": 1200 // ratio, "height": 800 // ratio, "deviceScaleFactor": ratio,
                "mobile": False})
            self.browser.wait("devicePixelRatio === arguments[0] && (({canvas}) => "
                              "canvas.width === arguments[0] * canvas.clientWidth)"
                              "(hulldViewer.stage)", ratio)

    def place_boxes(self, name, positions):
        """Writes a scene of boxes, and returns its file name."""
        scene = {"placements": [{"hullId": "box", "pose": {"translation": dict(zip("xyz", p))}}
                                for p in positions]}
        pathlib.Path(self.hulld.directory, name).write_text(json.dumps(scene))
        return name

    def test_objects_of_a_pair_have_different_colors(self):
        for count in (25, 210):
            self.view(self.place_boxes("colors.json", [(5 * i, 0, 0) for i in range(count)]))
            self.assertTrue(self.browser.js("""(() => {
              const {model} = hulldViewer;
              for (let a = 0; a < 25; ++a) {
                for (let b = 0; b < a; ++b) {
                  [model.selected, model.other] = [a, b];
                  const [p, q] = [a, b].map((i) => model.colorOf(model.objects[i]));
                  if (p === q) return false;
                }
              }
              model.objects[1].color = model.objects[0].color = '#123456';
              model.select(1, 0);
              return model.colorOf(model.objects[0]) !== model.colorOf(model.objects[1]);
            })()"""))
            # The drawn colors follow.
            self.assertEqual(self.browser.js("""[0, 1].map((i) => {
              const {views, model} = hulldViewer;
              const part = views.get(i).group.children.find((child) => child.isMesh);
              return '#' + part.material.color.getHexString() === model.colorOf(model.objects[i]);
            })"""), [True, True])

    def test_first_colliding_pair_is_selected(self):
        self.view(self.place_boxes("pairs.json", [(x, 0, 0) for x in (0, 10, 20, 22)]))
        self.browser.wait("hulldViewer.model.pair?.join() === '2,3'")
        self.assertEqual(self.assert_answers_as_api()["relation"], "RELATION_TOUCHING")
        # The user's choice is kept.
        self.keys(Keys.ESCAPE)
        self.browser.js("hulldViewer.ask(true)")
        self.browser.wait("hulldViewer.model.collisions.update === hulldViewer.update")
        self.assertIsNone(self.browser.js("hulldViewer.model.selected"))

    OUTSIDE = """hulldViewer.model.bounds().corners.filter((corner) => {
      const {stage} = hulldViewer;
      const seen = stage.toScreen(stage.local(corner));
      return !seen || seen[0] < 0 || seen[1] < 0 || seen[0] > stage.canvas.clientWidth ||
          seen[1] > stage.canvas.clientHeight;
    }).length"""

    def test_a_growing_hull_stays_in_view_unless_the_user_moved_the_camera(self):
        self.hulld.add_box("grows")
        self.view("grows")
        self.hulld.add("grows", ["30 0 0"])
        self.browser.wait(f"hulldViewer.model.hulls.get('grows').high[0] === 30 && !({self.OUTSIDE})")
        self.canvas().click()
        self.keys("+")
        self.hulld.add("grows", ["900 0 0"])
        self.browser.wait("hulldViewer.model.hulls.get('grows').high[0] === 900")
        self.browser.wait("!hulldViewer.stage.waiting && !hulldViewer.stage.flight")
        self.assertGreater(self.browser.js(self.OUTSIDE), 0)
        self.keys("f")
        self.browser.wait(f"!({self.OUTSIDE})")

    def test_the_plane_separates_and_ends_at_the_scene(self):
        self.view("room/left", "room/right")
        self.browser.wait(AT_REST)
        inside, spread, below, above = self.browser.js("""(() => {
          const {marks, model} = hulldViewer;
          const plane = marks.group.children.find((part) => part.material?.map && part.isMesh);
          const [low, high] = marks.boxOf(model.objects);
          const {array} = plane.geometry.attributes.position;
          const {x, y, z} = model.answer.axis.direction;
          const heightOf = (p) => Number(x) * p[0] + Number(y) * p[1] + Number(z) * p[2];
          const heights = Array.from(
              {length: array.length / 3},
              (_, i) => heightOf([0, 1, 2].map(
                  (k) => array[3 * i + k] * model.unit + model.origin[k])));
          const inside = [...array].every(
              (v, i) => v >= low.getComponent(i % 3) - 1e-5 && v <= high.getComponent(i % 3) + 1e-5);
          const [a, b] = model.objects.map((object) => model.cornersOf(object).map(heightOf));
          return [inside, Math.max(...heights) - Math.min(...heights),
                  heights[0] - Math.max(...a), Math.min(...b) - heights[0]];
        })()""")
        self.assertTrue(inside)
        self.assertLess(spread, 1e-5)
        self.assertGreater(below, 0)
        self.assertGreater(above, 0)

    def test_camera_presets_and_orthographic_view(self):
        self.view("box")
        self.browser.wait("hulldViewer.model.selected === 0")
        direction = ("(({stage}) => stage.camera.position.clone().sub(stage.controls.target)"
                     ".normalize().toArray())(hulldViewer)")
        third = 3 ** -0.5
        for name, key, expected in (("front", "a", (0, 0, 1)), ("top", "t", (0, 1, 0)),
                                    ("right", "s", (1, 0, 0)), ("isometric", "i", (third,) * 3)):
            for act in (lambda: self.browser.driver.find_element(
                            By.CSS_SELECTOR, f"[data-view='{name}']").click(),
                        lambda: self.keys(key)):
                self.browser.js("hulldViewer.stage.orbit(0.3, 0.2)")
                act()
                self.browser.wait("!hulldViewer.stage.waiting")
                for seen, wanted in zip(self.browser.js(direction), expected):
                    self.assertAlmostEqual(seen, wanted, delta=1e-3)
        # The near and the far side of the box look equally large only in the orthographic view.
        sides = """(() => {
          const {stage} = hulldViewer;
          const at = (x, y, z) => stage.toScreen(stage.local([x, y, z]))[0];
          return (at(1, 0, 1) - at(-1, 0, 1)) / (at(1, 0, -1) - at(-1, 0, -1));
        })()"""
        self.keys("a")
        self.browser.wait("!hulldViewer.stage.waiting")
        self.assertGreater(self.browser.js(sides), 1.1)
        self.keys("o")
        self.browser.wait("!hulldViewer.stage.waiting")
        self.assertAlmostEqual(self.browser.js(sides), 1)
        # Picking and the scale bar agree with the projection.
        self.canvas().click()
        self.browser.wait("hulldViewer.model.selected === 0")
        units, pixels, width = self.browser.js("""(() => {
          const {stage, model} = hulldViewer;
          const bar = document.querySelector('#scale');
          const at = (x) => stage.toScreen(stage.controls.target.clone()
              .add({x: x / model.unit, y: 0, z: 0}))[0];
          return [parseFloat(bar.textContent), bar.getBoundingClientRect().width, at(1) - at(0)];
        })()""")
        self.assertAlmostEqual(pixels / units, width, delta=0.02 * width)

    def test_labels_neither_overlap_nor_name_what_is_out_of_view(self):
        self.view(self.place_boxes("labels.json", [(3 * (i % 4), 0, 3 * (i // 4)) for i in range(16)]))
        visible = """[...document.querySelectorAll('#labels .label:not([hidden])')].map((label) => {
          const {left, right, top, bottom} = label.getBoundingClientRect();
          return [left, right, top, bottom];
        })"""
        for width, height in ((1440, 900), (390, 844)):
            self.browser.resize(width, height)
            self.browser.wait("innerWidth === arguments[0] && !hulldViewer.stage.waiting", width)
            boxes = self.browser.js(visible)
            self.assertGreater(len(boxes), 1)
            for i, p in enumerate(boxes):
                for q in boxes[:i]:
                    self.assertTrue(p[0] >= q[1] or q[0] >= p[1] or p[2] >= q[3] or q[2] >= p[3],
                                    (width, p, q))
        self.browser.js("""(({camera, controls}) => {
          camera.position.x += 1000;
          controls.target.x += 1000;
          controls.update();
        })(hulldViewer.stage)""")
        self.browser.wait("!hulldViewer.stage.waiting")
        self.assertEqual(self.browser.js(visible), [])

    def test_five_hundred_objects_take_few_draw_calls(self):
        self.view(self.place_boxes("hundreds.json", [(3 * (i % 25), 3 * (i // 25), 0)
                                                     for i in range(500)]))
        self.browser.wait("hulldViewer.crowd?.ranges.size === 500")
        self.browser.js("hulldViewer.model.select(7)")
        self.browser.wait("!hulldViewer.stage.waiting")
        self.assertEqual(self.browser.js("hulldViewer.crowd.ranges.size"), 498)
        self.assertLess(self.browser.js("""(() => {
          const {stage, gizmo} = hulldViewer;
          gizmo.handles.detach();
          stage.renderer.render(stage.scene, stage.camera);
          return stage.renderer.info.render.calls;
        })()"""), 20)

    def test_slow_motions_are_drawn_coarsely_and_rest_in_full(self):
        self.view("box")
        self.browser.wait("!hulldViewer.stage.waiting")
        size = "[hulldViewer.stage.canvas.width, hulldViewer.stage.canvas.height]"
        full = self.browser.js(size)
        coarse, lines = self.browser.js("""(() => {
          const {stage} = hulldViewer;
          // The third frame of a motion whose frames take a second each.
          for (let i = 0; i < 3; ++i) stage.adaptTo(1000);
          stage.renderer.render(stage.scene, stage.camera);
          return [[stage.canvas.width, stage.canvas.height], stage.camera.layers.mask];
        })()""")
        self.assertLess(coarse[0], full[0])
        self.assertEqual(lines, 1)
        self.browser.wait("!hulldViewer.stage.isCoarse && !hulldViewer.stage.waiting")
        self.assertEqual(self.browser.js(size), full)

    def test_points_have_the_color_of_their_object(self):
        self.view("room/left", "room/right")
        self.browser.js("(() => { const {model} = hulldViewer;"
                        " model.show = {...model.show, points: true, hull: false}; model.tell('shown'); })()")
        colors = self.browser.js("""[0, 1].map((i) => '#' + hulldViewer.views.get(i).group.children
            .find((part) => part.isPoints).material.color.getHexString())""")
        self.assertEqual(colors, self.browser.js(
            "hulldViewer.model.objects.map((object) => hulldViewer.model.colorOf(object))"))

    def test_radii_are_drawn_and_labeled(self):
        self.hulld.add("dot", ["0 0 0"])
        self.hulld.hullctl("body", "put", "dumbbell", "dot", "dot@3,0,0")
        self.addCleanup(self.hulld.hullctl, "body", "delete", "dumbbell")
        pathlib.Path(self.hulld.directory, "round.yaml").write_text(
            "place:\n  ball: {id: dot, radius: 2}\n  crate: {id: box, at: [6, 0, 0], radius: 0.5}\n"
            "  two: {id: dumbbell, at: [0, 9, 0], radius: 1}\n")
        self.view("round.yaml")
        self.browser.js("hulldViewer.model.select(1, 0)")
        self.assertAlmostEqual(self.assert_answers_as_api()["separation"]["value"], 2.5)
        self.assertEqual(self.browser.js("""[...document.querySelectorAll('#object-facts dt')]
            .find((dt) => dt.textContent === 'radius').nextElementSibling.textContent"""), "0.5")
        boxes = self.browser.js("""hulldViewer.model.objects.map((object) => {
          const {low, high} = hulldViewer.model.roundedOf(object);
          return [low, high];
        })""")
        # The surface is approximated from inside; moved facets are exact.
        self.assertEqual(boxes[1], [[-1.5] * 3, [1.5] * 3])
        for (low, high), radius, length in ((boxes[0], 2, 0), (boxes[2], 1, 3)):
            for k in range(3):
                self.assertLessEqual(high[k], radius + (length if k == 0 else 0) + 1e-9)
                self.assertAlmostEqual(high[k], radius + (length if k == 0 else 0), delta=0.05 * radius)
                self.assertAlmostEqual(low[k], -radius, delta=0.05 * radius)
        # A ball is solid, a radius around a solid is glass, and clicks hit them.
        self.assertEqual(self.browser.js("""[0, 1].map((i) => hulldViewer.views.get(i).group.children
            .filter((part) => part.isMesh).map(({material}) => material.opacity).pop())"""), [1, 0.3])
        self.browser.js("(hulldViewer.model.show.labels = false, hulldViewer.model.select(null))")
        x, y = self.browser.js("""(() => {
          const {stage, model} = hulldViewer;
          const p = model.drawn([0, 0, 1.5]);
          return stage.toScreen(stage.controls.target.clone().set(...p));
        })()""")
        width, height = self.browser.js(
            "[hulldViewer.stage.canvas.clientWidth, hulldViewer.stage.canvas.clientHeight]")
        ActionChains(self.browser.driver).move_to_element_with_offset(
            self.canvas(), round(x - width / 2), round(y - height / 2)).click().perform()
        self.browser.wait("hulldViewer.model.selected === 0")

    def test_opacity_of_one_object(self):
        self.view("room/left", "room/right")
        self.browser.js("(() => { const slider = document.querySelector('#opacity');"
                        " slider.value = 0.4; slider.dispatchEvent(new Event('input')); })()")
        self.assertEqual(self.browser.js("""[0, 1].map((i) => Math.min(...hulldViewer.views.get(i)
            .group.children.filter((part) => part.isMesh).map(({material}) => material.opacity)))"""),
                         [1, 0.2])

    def test_saved_picture_is_that_of_the_stage(self):
        self.view("room/left", "room/right")
        self.browser.js("(HTMLAnchorElement.prototype.click = function() {"
                        " globalThis.saved = [this.download, this.href]; })")
        self.browser.driver.find_element(By.ID, "save").click()
        name, data = self.browser.wait("globalThis.saved")
        self.assertEqual(name, "hulld.png")
        png = base64.b64decode(data.removeprefix("data:image/png;base64,"))
        self.assertEqual(list(struct.unpack(">II", png[16:24])), self.browser.js(
            "[hulldViewer.stage.canvas.width, hulldViewer.stage.canvas.height]"))

    # --- Undo, measuring, copying ---

    def test_undo_restores_poses_bit_for_bit(self):
        self.view("room/left", "room/right")
        self.assert_answers_as_api()
        poses = "hulldViewer.model.objects.map(({pose}) => pose)"
        start = self.browser.js(poses)
        self.drag_handle(-60, 20)
        self.browser.wait("hulldViewer.model.history.length === 1")
        dragged = self.browser.js(poses)
        self.browser.js("hulldViewer.model.select(0, 1)")
        self.keys("x")
        self.browser.wait("hulldViewer.model.history.length === 2")
        self.keys("u")
        self.browser.wait("hulldViewer.model.history.length === 1")
        self.assertEqual(self.browser.js(poses), dragged)
        self.browser.driver.find_element(By.ID, "undo").click()
        self.browser.wait("hulldViewer.model.history.length === 0")
        self.assertEqual(self.browser.js(poses), start)
        self.assertTrue(self.browser.js("document.querySelector('#undo').disabled"))
        self.assert_answers_as_api()

    def test_measures_between_two_corners(self):
        self.view("box")
        self.browser.wait("hulldViewer.model.selected === 0")
        self.browser.js("hulldViewer.model.select(null)")
        self.keys("q")
        width, height = self.browser.js(
            "[hulldViewer.stage.canvas.clientWidth, hulldViewer.stage.canvas.clientHeight]")
        for corner in ((-1, 1, 1), (1, 1, -1)):
            x, y = self.browser.js("""(() => {
              const {stage, model} = hulldViewer;
              const [x, y, z] = model.drawn(arguments[0]);
              // Slightly toward the center of the upper face, for a hit.
              return stage.toScreen(stage.controls.target.clone().set(0.97 * x, y, 0.97 * z));
            })()""", corner)
            ActionChains(self.browser.driver).move_to_element_with_offset(
                self.canvas(), round(x - width / 2), round(y - height / 2)).click().perform()
        self.browser.wait("hulldViewer.ruler.ends.length === 2")
        self.assertEqual(float(self.browser.js("document.querySelector('#measured').title")), 8 ** 0.5)
        self.assertEqual(self.browser.text("#measured"), "2.828")
        self.keys(Keys.ESCAPE)
        self.assertTrue(self.browser.js("document.querySelector('#measured').hidden"))

    def test_copies_a_pose_that_hullctl_accepts(self):
        self.view("room/left", "room/right")
        self.browser.js("(navigator.clipboard.writeText = async (text) => { globalThis.copied = text; })")
        self.browser.js("hulldViewer.model.setPose(1, [1, 0, 0, 0, 0.1, 1e-17, -0.3], true)")
        answer = self.assert_answers_as_api()
        self.browser.driver.find_element(By.ID, "copy-hullctl").click()
        copied = self.browser.wait("globalThis.copied")
        again = self.hulld.json("check", "room/left", *shlex.split(copied), "--separation")
        self.assertEqual(again["separation"], answer["separation"])
        self.browser.driver.find_element(By.ID, "copy-python").click()
        copied = self.browser.wait("globalThis.copied.startsWith('(') && globalThis.copied")
        self.assertEqual(ast.literal_eval(copied), ("room/right", [1, 0, 0, 0, 0.1, 1e-17, -0.3]))

    def test_numbers_are_short_and_exact_while_edited(self):
        self.view("room/left", "room/right")
        self.browser.js("hulldViewer.model.setPose(1, [1, 0, 0, 0, 0.1 + 0.2, 0, 0], true)")
        field = self.browser.driver.find_element(By.CSS_SELECTOR, "[data-pose='4']")
        self.assertEqual(field.get_attribute("value"), "0.3")
        self.assertEqual(field.get_attribute("title"), "0.30000000000000004")
        field.click()
        self.assertEqual(field.get_attribute("value"), "0.30000000000000004")
        field.send_keys(Keys.TAB)
        self.assertEqual(field.get_attribute("value"), "0.3")
        self.assertEqual(self.browser.js("hulldViewer.model.objects[1].pose[4]"), 0.1 + 0.2)

    def test_controls_are_above_the_fold(self):
        self.view("room/left", "room/right")
        self.assert_answers_as_api()
        for selector in ("[data-pose='6']", "#opacity", "#copy-python", "#simplify"):
            self.assertLess(self.browser.js(
                "document.querySelector(arguments[0]).getBoundingClientRect().bottom", selector), 900)

    def test_tree_has_a_group_for_each_prefix(self):
        for name in ("cell/arm/link-1", "cell/arm/link-2", "cell/table"):
            self.hulld.add_box(name)
        self.view("cell/")
        rows = ("[...document.querySelectorAll('#tree .row .name')]"
                ".map((row) => row.textContent.replace(/[^a-z0-9/-]/g, ' ').trim().split(/ +/)[0])")
        self.browser.wait(f"{rows}.length === 5")
        self.assertEqual(self.browser.js(rows), ["cell/", "arm/", "link-1", "link-2", "table"])
        self.browser.driver.find_element(By.CSS_SELECTOR, "[data-row='group cell/arm/']").click()
        self.assertEqual(self.browser.js(rows), ["cell/", "arm/", "table"])
        self.browser.driver.find_element(By.CSS_SELECTOR, "[data-row='group-eye cell/arm/']").click()
        self.assertEqual(self.browser.js("hulldViewer.model.objects.map(({visible}) => visible)"),
                         [False, False, True])


if __name__ == "__main__":
    viewer_case.main()
