"""Tests of the viewer's page in a real browser: it shows the server's answers.

    /usr/bin/python3 viewer_test.py BIN_DIRECTORY [TEST...]
"""

import json
import pathlib

import viewer_case
import viewing
from viewer_case import AT_REST

from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys


class ViewerTest(viewer_case.ViewerCase):
    # --- Pictures ---

    def test_the_canvas_shows_exactly_the_visible_objects(self):
        self.view("room/")
        full = self.pixels()
        self.assertGreater(full["colors"], 20)
        self.assertGreater(full["drawn"], 0.03)
        self.browser.driver.find_element(By.TAG_NAME, "body").click()
        self.keys("l")
        for index in range(2):
            self.browser.driver.find_element(By.CSS_SELECTOR, f"[data-row='eye {index}']").click()
        self.browser.wait("hulldViewer.model.objects.every((o) => !o.visible)")
        self.assertLess(self.pixels()["drawn"], full["drawn"] / 3)

    def test_points_mesh_and_hull_are_drawn_separately_and_together(self):
        self.view("/usr/share/assimp/models/OBJ/spider.obj")
        drawn = {}
        for shown in (["points"], ["mesh"], ["hull"], ["mesh", "hull", "edges"]):
            self.browser.js("""(() => {
              const {model} = hulldViewer;
              for (const key of ['points', 'mesh', 'hull', 'edges']) model.show[key] = false;
              for (const key of arguments[0]) model.show[key] = true;
              model.show.labels = false;
              model.select(null);
              model.tell('shown');
            })()""", shown)
            drawn["+".join(shown)] = self.pixels()["drawn"]
        self.assertGreater(drawn["points"], 0.001)
        self.assertGreater(drawn["mesh"], drawn["points"])
        # A hull covers the gaps of its mesh.
        self.assertGreater(drawn["hull"], 1.3 * drawn["mesh"])
        self.assertGreater(drawn["mesh+hull+edges"], 0.98 * drawn["hull"])
        self.browser.js("hulldViewer.model.select(0)")
        facts = self.browser.wait("document.querySelector('#object-facts').textContent")
        self.assertIn("1\u2009368 triangles", facts)
        self.assertRegex(facts, r"times the area of its mesh")

    # --- Answers ---

    def test_answers_are_those_of_the_api(self):
        self.view("room/left", "room/right")
        answer = self.assert_answers_as_api()
        self.assertEqual(answer["relation"], "RELATION_SEPARATED")
        self.assertAlmostEqual(answer["separation"]["value"], 1)

    def test_a_drag_shows_the_answer_of_the_api(self):
        self.view("room/left", "room/right")
        self.assert_answers_as_api()
        before = self.browser.js("hulldViewer.model.objects[1].pose")
        self.browser.js("(globalThis.live = [], "
                        "hulldViewer.connection.socket.addEventListener('message', ({data}) => "
                        "typeof data === 'string' && live.push(JSON.parse(data))))")
        self.drag_handle(-120, 40)
        self.browser.wait("arguments[0].some((v, i) => v !== hulldViewer.model.objects[1].pose[i])",
                          before)
        self.assert_answers_as_api()
        # Answers also arrived during the motion.
        self.assertGreater(self.browser.js(
            "live.filter((m) => m.type === 'answer' && !m.rest).length"), 0)
        # A move preserves the rotation, bit for bit.
        self.assertEqual(self.browser.js("hulldViewer.model.objects[1].pose.slice(0, 4)"),
                         [1, 0, 0, 0])

    def test_rotating_by_the_handles_updates_the_answer(self):
        self.view("room/left", "room/right")
        self.assert_answers_as_api()
        self.browser.driver.find_element(By.ID, "mode-turn").click()
        self.drag_handle(60, 25)
        self.browser.wait("hulldViewer.model.objects[1].pose[0] !== 1")
        self.assert_answers_as_api()

    def test_typed_pose_touches_exactly(self):
        self.view("room/left", "room/right")
        self.assert_answers_as_api()
        for index, value in ((4, "-1"), (5, "0.1"), (6, "1e-300")):
            field = self.browser.driver.find_element(By.CSS_SELECTOR, f"[data-pose='{index}']")
            field.clear()
            field.send_keys(value, Keys.TAB)
        self.browser.wait("hulldViewer.model.objects[1].pose[6] === 1e-300")
        answer = self.assert_answers_as_api()
        self.assertEqual(answer["relation"], "RELATION_TOUCHING")
        self.browser.wait("document.querySelector('#collision-count').textContent === '1 pair collides'")
        # Moved by the smallest step of a double, they are apart.
        field = self.browser.driver.find_element(By.CSS_SELECTOR, "[data-pose='4']")
        field.clear()
        field.send_keys("-0.9999999999999999", Keys.TAB)
        self.browser.wait("hulldViewer.model.objects[1].pose[4] !== -1")
        self.assertEqual(self.assert_answers_as_api()["relation"], "RELATION_SEPARATED")
        self.browser.wait("document.querySelector('#collision-count').textContent === 'No pair collides'")

    def test_a_click_on_a_colliding_pair_flies_there(self):
        scene = {"placements": [{"hullId": "box", "pose": {"translation": {"x": x, "y": 0, "z": 0}}}
                                for x in (0, 100, 101, 200)]}
        pathlib.Path(self.hulld.directory, "scene.json").write_text(json.dumps(scene))
        self.view("scene.json")
        pair = self.browser.wait("document.querySelector('#collisions li button')")
        self.browser.js("arguments[0].click()", pair)
        self.browser.wait(
            "(({model, stage}) => Math.abs(stage.controls.target.x * model.unit + model.origin[0]"
            " - 100.5) < 1e-6)(hulldViewer)")
        answer = self.assert_answers_as_api()
        self.assertAlmostEqual(answer["separation"]["value"], -1)

    # --- Bodies ---

    def test_a_body_is_one_object_that_is_dragged_whole(self):
        self.hulld.hullctl("body", "put", "room/stool", "box", "box@4,0,0", "box@1,0,0,1,2,4,0")
        self.addCleanup(self.hulld.hullctl, "body", "delete", "room/stool")
        self.view("room/right", "room/stool")
        # The row of the body, and the rows of its pieces.
        self.assertEqual(self.browser.js("hulldViewer.model.objects.map(({name}) => name)"),
                         ["room/right", "room/stool"])
        self.assertEqual(self.browser.js("[...document.querySelectorAll('#tree .piece .name')]"
                                         ".map((row) => row.textContent)"),
                         ["0: box", "1: box", "2: box"])
        # The third is rotated by a quarter turn about its center.
        shape = "hulldViewer.model.hullOf(hulldViewer.model.objects[1])."
        self.assertEqual(self.browser.js(f"[{shape}low, {shape}high, {shape}vertexCount]"),
                         [[-1, -1, -1], [5, 5, 1], 24])
        self.assertGreater(self.pixels()["drawn"], 0.03)
        answer = self.assert_answers_as_api()
        self.assertEqual(self.browser.fact("piece of B"), f"{answer['pieceB']['index']}: box")
        self.drag_handle(-110, 40)
        self.browser.wait("hulldViewer.model.objects[1].pose.some((v, i) => v !== [1,0,0,0,0,0,0][i])")
        self.assert_answers_as_api()
        # Values that show the deciding piece, with marks at its position.
        for x, decider in (("-2.5", 1), ("2.5", 0)):
            field = self.browser.driver.find_element(By.CSS_SELECTOR, "[data-pose='4']")
            field.clear()
            field.send_keys(x, Keys.TAB)
            for index in (5, 6):
                field = self.browser.driver.find_element(By.CSS_SELECTOR, f"[data-pose='{index}']")
                field.clear()
                field.send_keys("1", Keys.TAB)
            self.browser.wait("hulldViewer.model.objects[1].pose[4] === arguments[0]", float(x))
            answer = self.assert_answers_as_api()
            self.assertEqual(answer["pieceB"]["index"], decider)
            self.assertEqual(self.browser.js(
                "[...document.querySelectorAll('#tree .piece')]"
                ".findIndex((row) => row.textContent.includes('decides'))"), decider)
            # The certificate's vertices, each a corner of the piece, in the world.
            self.assertTrue(self.browser.js("""(() => {
              const {model, marks} = hulldViewer;
              const [, piece] = model.decidingPieces();
              const {certificate} = model.answer;
              const {x, y, z} = certificate.pairs[0].vertexB;
              const placed = model.placed(model.objects[1], piece, [x, y, z].map(Number));
              return certificate.pairs.length > 0 &&
                  placed.every((v, k) => Math.abs(v - model.objects[1].pose[4 + k] -
                                                  piece.pose[4 + k]) <= 1) &&
                  marks.group.children.length > 0;
            })()"""))

    def test_a_body_follows_its_pieces_and_may_lack_one(self):
        self.hulld.add_box("leg", size=1.0, low=(0.0, 0.0, 0.0))
        self.hulld.hullctl("body", "put", "pair", "leg", "leg@3,0,0", "lid@0,0,1")
        self.addCleanup(self.hulld.hullctl, "body", "delete", "pair")
        self.view("pair")
        self.browser.wait("document.querySelector('#tree').textContent.includes('missing')")
        shape = "hulldViewer.model.hullOf(hulldViewer.model.objects[0])"
        self.browser.wait(f"{shape}.vertexCount === 16")
        # It grows at both places, and the missing piece appears.
        self.hulld.add("leg", ["0.5 0.5 -2"])
        self.browser.wait(f"{shape}.vertexCount === 18 && {shape}.low[2] === -2")
        self.hulld.add_box("lid", size=1.0, low=(0.0, 0.0, 0.0))
        self.browser.wait(f"{shape}.vertexCount === 26")
        self.browser.wait("!document.querySelector('#tree').textContent.includes('missing')")
        # Put again, with hulls unknown to the viewer.
        self.hulld.add_box("other", size=1.0, low=(7.0, 0.0, 0.0))
        self.hulld.hullctl("body", "put", "pair", "other")
        self.browser.wait(f"{shape}.low[0] === 7 && {shape}.vertexCount === 8")
        self.hulld.add("other", ["9 0.5 0.5"])
        self.browser.wait(f"{shape}.high[0] === 9")

    def test_pieces_are_shown_only_with_their_body(self):
        for side in ("a", "b"):
            self.hulld.add_box(f"parts/{side}")
        self.hulld.hullctl("body", "put", "parts/all", "parts/a", "parts/b@3,0,0")
        self.addCleanup(self.hulld.hullctl, "body", "delete", "parts/all")
        names = "hulldViewer.model.objects.map(({name}) => name)"
        self.view("parts/")
        self.assertEqual(self.browser.js(names), ["parts/all"])
        self.view("parts/a", "parts/all")
        self.assertEqual(self.browser.js(names), ["parts/a", "parts/all"])
        target = pathlib.Path(self.hulld.directory, "parts.html")
        self.hulld.hullctl("view", "parts/a", "parts/all", "--html", str(target))
        self.browser.driver.get(target.as_uri())
        self.browser.wait("document.body.dataset.fitted")
        self.assertEqual(self.browser.js(
            "hulldViewer.model.hullOf(hulldViewer.model.objects[1]).vertexCount"), 16)
        self.browser.wait("document.querySelector('#relation').textContent.includes('overlapping')")

    def test_a_body_of_a_thousand_pieces(self):
        pieces = [{"hullId": "box", "pose": {"translation": {"x": 3 * (i % 10), "y": 3 * (i // 10 % 10),
                                                             "z": 3 * (i // 100)}}}
                  for i in range(1000)]
        pathlib.Path(self.hulld.directory, "block.json").write_text(json.dumps({"pieces": pieces}))
        self.hulld.hullctl("body", "put", "block", "--pieces", "block.json")
        self.addCleanup(self.hulld.hullctl, "body", "delete", "block")
        self.view("block", "room/right")
        shape = "hulldViewer.model.hullOf(hulldViewer.model.objects[0])"
        self.browser.wait(f"{shape}.vertexCount === 8000")
        self.assert_answers_as_api()
        self.drag_handle(60, 20)
        self.assert_answers_as_api()

    # --- Changes of hulls ---

    def test_hulls_grow_appear_and_disappear(self):
        self.hulld.add_box("live/a", size=1.0, low=(0.0, 0.0, 0.0))
        self.view("live/")
        self.browser.wait("hulldViewer.model.hulls.get('live/a')?.vertexCount === 8")
        self.hulld.add("live/a", ["0.5 0.5 3"])
        self.browser.wait("hulldViewer.model.hulls.get('live/a').vertexCount === 9")
        self.browser.wait("hulldViewer.model.hulls.get('live/a').high[2] === 3")
        self.hulld.add_box("live/b", size=1.0, low=(5.0, 0.0, 0.0))
        self.browser.wait("[...document.querySelectorAll('.row')].some((r) => r.textContent.includes('b'))"
                          " && hulldViewer.model.hulls.get('live/b')?.vertexCount === 8")
        # They collide after one grows into the other, without any motion.
        self.hulld.add("live/a", ["5.5 0.5 0.5"])
        self.browser.wait("document.querySelector('#collision-count').textContent === '1 pair collides'")
        self.hulld.hullctl("delete", "live/b")
        self.browser.wait("document.querySelector('#tree').textContent.includes('deleted')")
        self.browser.wait("document.querySelector('#collision-count').textContent === 'No pair collides'")

    def test_answers_return_after_a_restart_of_the_server(self):
        self.hulld = viewing.Hulld(self.programs)
        self.addCleanup(self.hulld.stop)
        self.hulld.add_box("a")
        self.hulld.add_box("b", low=(2.0, 0.0, 0.0))
        self.view()
        self.browser.wait(AT_REST)
        self.hulld.process.stop()
        self.browser.js("hulldViewer.ask(true)")
        self.browser.wait("hulldViewer.model.answer.problem")
        self.hulld.start()
        self.assert_answers_as_api()

    def test_new_vertices_flash(self):
        self.hulld.add_box("flash")
        self.view("flash")
        self.browser.js("(hulldViewer.stage.frame = ((frame) => function(now) {"
                        "  globalThis.flashes = Math.max(globalThis.flashes || 0, hulldViewer.views.get(0)"
                        "    .group.children.filter((part) => part.userData.end).length);"
                        "  return frame.call(this, now); })(hulldViewer.stage.frame))")
        self.hulld.add("flash", ["0 0 5"])
        self.browser.wait("globalThis.flashes === 1")
        # They fade, and then disappear.
        self.browser.wait("!hulldViewer.stage.waiting && "
                          "hulldViewer.views.get(0).group.children.every((part) => !part.userData.end)")

    def test_demo_has_eight_scenes_with_a_key_each(self):
        self.view("--demo")
        expected = {"0": "separated", "1": "overlapping", "2": "touching", "3": "touching",
                    "4": "overlapping", "6": "separated"}
        self.canvas().click()
        for key in "12345670":
            self.keys(key)
            self.browser.wait("document.body.dataset.scene === arguments[0] && "
                              "document.body.dataset.fitted === arguments[0]", key)
            if key in expected:
                self.browser.wait("document.querySelector('#relation')?.textContent.includes(arguments[0])",
                                  expected[key])
                self.assert_answers_as_api()
            if key == "5":
                self.browser.wait(
                    "document.querySelector('#collision-count').textContent === '3 pairs collide'")
            if key == "7":
                self.browser.wait("hulldViewer.model.objects[0].name === 'live'")
                self.browser.wait("document.querySelector('#collision-count').textContent"
                                  " === '1 pair collides'", seconds=90)

    # --- The page ---

    def test_a_simplified_hull_is_shown_with_its_proven_error(self):
        self.view("/usr/share/assimp/models/OBJ/spider.obj")
        self.browser.js("(() => { const slider = document.querySelector('#simplify');"
                        " slider.value = 30; slider.dispatchEvent(new Event('input')); })()")
        self.browser.wait("hulldViewer.shell.group.children.length === 2")
        facts = self.browser.wait("[...document.querySelectorAll('#panel-object dt')].find((dt) => "
                                  "dt.textContent === 'proven error')"
                                  "?.nextElementSibling.firstChild.title")
        self.assertGreater(float(facts), 0)
        # The hull lies within the shell: no vertex is farther out than the error.
        self.assertTrue(self.browser.js("""(() => {
          const {model, shell} = hulldViewer;
          const position = shell.group.children[1].geometry.attributes.position.array
              .map((value) => value * model.unit);
          const hull = model.hulls.get(model.objects[0].hullId);
          const reach = (xyz, n, c) => {
            let most = -Infinity;
            for (let i = 0; i < xyz.length; i += 3) {
              most = Math.max(most, xyz[i] + c[0]);
            }
            return most;
          };
          return reach(position, 0, shell.group.children[1].userData.center) >=
              reach(hull.xyz, 0, [0, 0, 0]) - 1e-4;
        })()"""))

    def test_the_answer_for_a_simplified_hull_is_shown_next_to_the_exact_one(self):
        self.hulld.hullctl("generate", "sphere", "200", "--seed", "3", "-o", "ball.xyz")
        self.hulld.hullctl("append", "ball", "ball.xyz", "--create")
        self.view("room/right", "ball")
        self.browser.js("hulldViewer.model.setPose(1, [1, 0, 0, 0, 0.2, 0.5, 0.5], true)")
        separation = self.assert_answers_as_api()["separation"]["value"]
        rows = """Object.fromEntries([...document.querySelectorAll('.result dt')].map((dt) => [
          dt.textContent, [...dt.nextElementSibling.querySelectorAll('[title]')].map((e) => +e.title)]))"""
        for side in ("inside", "outside"):
            self.browser.js("""(() => {
              const select = document.querySelector('select[aria-label="Side"]');
              select.value = arguments[0];
              select.dispatchEvent(new Event('change'));
              const slider = document.querySelector('#simplify');
              slider.value = 30;
              slider.dispatchEvent(new Event('input'));
            })()""", side)
            self.browser.wait("hulldViewer.objectPanel.simpler && hulldViewer.model.answer?.rest && "
                              "document.querySelector('.result dt')")
            shown = self.browser.js(rows)
            self.assertEqual(shown["exact separation"], [separation])
            # The server's answer for a hull of the simpler hull's vertices lies between the bounds.
            xyz = self.browser.js("[...hulldViewer.objectPanel.simpler.xyz]")
            self.hulld.add(f"simple-{side}", [" ".join(map(repr, xyz[i:i + 3]))
                                              for i in range(0, len(xyz), 3)])
            simple = self.hulld.json("check", "room/right", f"simple-{side}", "--separation",
                                     "--pose-b", "1,0,0,0,0.2,0.5,0.5")["separation"]
            low, high = shown["of the simpler hull"]
            self.assertLess(len(xyz), 3 * 200)
            self.assertLessEqual(low, simple["value"] + simple["bound"])
            self.assertGreaterEqual(high, simple["value"] - simple["bound"])

    def test_the_shell_of_many_facets_is_at_the_distance_of_the_tolerance(self):
        self.hulld.hullctl("generate", "sphere", "12000", "-o", "many.xyz")
        self.hulld.hullctl("append", "many", "many.xyz", "--create")
        self.view("many")
        self.assertGreater(self.browser.js("hulldViewer.model.hulls.get('many').facetCount"), 20000)
        self.browser.js("(() => { const slider = document.querySelector('#tolerance');"
                        " slider.value = 60; slider.dispatchEvent(new Event('input')); })()")
        self.browser.wait("hulldViewer.shell.group.children.length === 1")
        # Distance that each vertex of the sphere was moved from its center, in tolerances.
        least, most = self.browser.js("""(() => {
          const {model, shell} = hulldViewer;
          const {xyz, center} = model.hulls.get('many');
          const at = shell.group.children[0].geometry.attributes.position.array
              .map((value) => value * model.unit);
          let [least, most] = [Infinity, -Infinity];
          for (let i = 0; i < xyz.length; i += 3) {
            const was = Math.hypot(...[0, 1, 2].map((k) => xyz[i + k] - center[k]));
            const moved = (Math.hypot(at[i], at[i + 1], at[i + 2]) - was) / model.tolerance;
            least = Math.min(least, moved);
            most = Math.max(most, moved);
          }
          return [least, most];
        })()""")
        self.assertGreater(least, 0.98)
        self.assertLess(most, 1.0001)

    def test_the_layout_fits_phones_and_desktops(self):
        self.view("room/")
        for width, height in ((390, 844), (1440, 900), (768, 1024)):
            self.browser.resize(width, height)
            self.browser.wait("innerWidth === arguments[0]", width)
            self.assertLessEqual(self.browser.js("document.documentElement.scrollWidth"), width)
            self.assertGreater(self.browser.js("document.querySelector('#stage').clientHeight"), 250)
            if width < 760:
                for panel in ("objects", "answer", "object"):
                    self.browser.driver.find_element(By.ID, f"tab-{panel}").click()
                    self.browser.wait("document.querySelector('#panel-' + arguments[0]).clientHeight > 150",
                                      panel)
            unreachable = self.browser.js("""(() => {
              const shown = [...document.querySelectorAll('button, input, select')]
                  .filter((e) => e.offsetParent && !e.closest('dialog'));
              return shown.filter((e) => {
                e.scrollIntoView({block: 'nearest'});
                const {left, right} = e.getBoundingClientRect();
                return left < -1 || right > innerWidth + 1;
              }).map((e) => e.outerHTML.slice(0, 80));
            })()""")
            self.assertEqual(unreachable, [])

    def test_every_control_has_a_name(self):
        self.view("room/")
        self.browser.js("hulldViewer.model.select(0)")
        self.browser.wait(AT_REST)
        nameless = self.browser.js("""[...document.querySelectorAll('button, input, select')]
            .filter((e) => !(e.textContent.trim() || e.getAttribute('aria-label') ||
                             e.closest('label')?.textContent.trim()))
            .map((e) => e.outerHTML)""")
        self.assertEqual(nameless, [])

    def test_everything_works_by_keyboard(self):
        self.view("room/")
        self.browser.wait("hulldViewer.model.collisions.revision")
        viewer = "hulldViewer.model."
        self.keys(Keys.ESCAPE)
        self.browser.wait(viewer + "selected === null")
        self.keys("j")
        self.browser.wait(viewer + "selected === 0")
        self.keys("j")
        self.browser.wait(viewer + "selected === 1")
        self.browser.wait(AT_REST)
        self.keys("x")
        self.browser.wait(viewer + "objects[1].pose[4] > 0")
        self.assert_answers_as_api()
        self.keys(Keys.BACKSPACE)
        self.browser.wait(viewer + "objects[1].pose[4] === 0")
        for key, name in (("p", "points"), ("h", "hull"), ("e", "edges"), ("l", "labels")):
            was = self.browser.js(f"{viewer}show.{name}")
            self.keys(key)
            self.browser.wait(f"{viewer}show.{name} !== arguments[0]", was)
        self.keys("v")
        self.browser.wait(f"!{viewer}objects[1].visible")
        self.keys("r")
        self.browser.wait("hulldViewer.gizmo.mode === 'rotate'")
        theme = self.browser.js("document.documentElement.dataset.theme")
        self.keys("d")
        self.browser.wait("document.documentElement.dataset.theme !== arguments[0]", theme)
        where = self.browser.js("hulldViewer.stage.camera.position.toArray()")
        self.keys(Keys.ARROW_LEFT)
        self.browser.wait("arguments[0].some((v, i) => v !== hulldViewer.stage.camera.position.toArray()[i])",
                          where)
        self.keys("/")
        self.browser.wait("document.activeElement.id === 'search'")
        self.keys("right", Keys.ENTER)
        self.browser.wait("document.querySelectorAll('#tree .row[data-index]').length === 1")
        self.keys(Keys.ESCAPE, "?")
        self.browser.wait("document.querySelector('#keys').open")
        self.keys(Keys.ESCAPE)
        self.browser.wait("!document.querySelector('#keys').open")

    def test_nothing_jitters_far_from_the_origin(self):
        self.hulld.add_box("far/here")
        scene = {"placements": [
            {"hullId": "far/here", "pose": {"translation": {"x": 1e9, "y": -1e9, "z": 1e9}}},
            {"hullId": "far/here", "pose": {"translation": {"x": 1e9 + 2.5, "y": -1e9, "z": 1e9}}}]}
        pathlib.Path(self.hulld.directory, "far.json").write_text(json.dumps(scene))
        self.view("far.json")
        # GPU coordinates are near 0, where float is precise.
        positions = self.browser.js(
            "[...hulldViewer.views.values()].map((view) => "
            "view.group.position.toArray().map((x) => x * hulldViewer.model.unit))")
        self.assertEqual(positions, [[-1.25, 0, 0], [1.25, 0, 0]])
        self.assertGreater(self.pixels()["drawn"], 0.03)
        answer = self.assert_answers_as_api()
        self.assertAlmostEqual(answer["separation"]["value"], 0.5)

    def test_a_thousand_hulls_are_drawn_searched_and_picked(self):
        side = 10
        scene = {"packedPlacements": {
            "hullIds": ["box"], "hulls": [0] * side**3,
            "poses": [v for i in range(side**3) for v in
                      (1, 0, 0, 0, 4 * (i % side), 4 * (i // side % side), 4 * (i // side**2))]}}
        pathlib.Path(self.hulld.directory, "many.json").write_text(json.dumps(scene))
        self.view("many.json")
        self.browser.wait("hulldViewer.crowd?.group.children.length > 0")
        self.assertGreater(self.pixels()["colors"], 20)
        self.browser.wait("document.querySelector('#collision-count').textContent === 'No pair collides'")
        self.canvas().click()
        self.browser.wait("hulldViewer.model.selected !== null")
        self.assert_answers_as_api()

    def test_the_tolerant_answer_is_shown_next_to_the_exact_one(self):
        self.view("room/left", "room/right")
        self.assert_answers_as_api()
        self.browser.js("(() => { const slider = document.querySelector('#tolerance');"
                        " slider.value = 60; slider.dispatchEvent(new Event('input')); })()")
        self.browser.wait("hulldViewer.model.answer?.tolerant")
        tolerance = self.browser.fact("tolerance")
        self.assertEqual(float(tolerance), self.browser.js("hulldViewer.model.tolerance"))
        answer = self.hulld.json("check", "room/left", "room/right", "--tolerance", tolerance)
        self.assertEqual(answer["relation"],
                         self.browser.js("hulldViewer.model.answer.tolerant.relation"))
        # The exact answer remains visible.
        self.assert_answers_as_api()

    def test_the_address_admits_one_browser_once(self):
        viewer = self.hulld.view("box")
        self.addCleanup(viewer.stop)
        self.browser.open(viewer.address)
        # The token is removed from the address, and scripts cannot read the cookie.
        self.assertNotIn("token", self.browser.driver.current_url)
        self.assertEqual(self.browser.js("document.cookie"), "")
        port = viewer.address.split(":")[2].split("/")[0]
        [cookie] = [c for c in self.browser.driver.get_cookies() if c["name"].endswith(port)]
        self.assertTrue(cookie["httpOnly"])
        self.assertEqual(cookie["sameSite"], "Strict")
        self.browser.driver.refresh()
        self.browser.wait("document.body.dataset.fitted")
        self.browser.driver.delete_all_cookies()
        self.browser.driver.get(viewer.address)
        self.assertIn("was already used", self.browser.text("body"))
        self.browser.driver.get("about:blank")
        # Refusals are errors for the console.
        self.browser.problems()


if __name__ == "__main__":
    viewer_case.main()
