"""Renders the pictures of the viewer in README.md and client/guide/VIEWER.md, and writes the page
arm.html.

    /usr/bin/python3 pictures.py BIN_DIRECTORY OUTPUT_DIRECTORY
"""

import math
import pathlib
import re
import subprocess
import sys

import viewing

viewing.skip_unless_browser()


#: A spider falls past a ball and turns.
MOTION = """hulls: {center: {points: [[0, 0, 0]]}}
place:
  ball: {hull: center, radius: 40, at: [30, -20, 70]}
  spider: {id: spider, at: [-40, 170, 0], to: {xyz: [-30, -160, 40], rpy: [0.4, 2, 0.6]}}
"""


def take(hulld, target, arguments, width, height, dark=False, before="true"):
    """Renders `hullctl view ARGUMENTS` at rest, after running `before` in the page."""
    viewer = hulld.view(*arguments)
    browser = viewing.Browser(width, height, dark)
    try:
        browser.open(viewer.address)
        browser.js(before)
        browser.wait("hulldViewer.model.answer?.rest && "
                     "hulldViewer.model.answer.update === hulldViewer.update")
        browser.wait("!hulldViewer.stage.waiting && document.querySelector('#message').hidden")
        browser.driver.save_screenshot(str(target))
    finally:
        browser.close()
        viewer.stop()


def write_page(programs, target):
    """Writes a page that plays a trajectory of the arm in ROBOTS.md: it folds onto its base."""
    source = pathlib.Path(__file__).resolve().parents[4]
    guide = (source / "client/guide/ROBOTS.md").read_text()
    folder = target.parent
    (folder / "arm.urdf").write_text(re.search(r"```xml\n(.*?)```", guide, re.S)[1])
    rows = ["shoulder,elbow"]
    for step in range(31):
        fold = (1 - math.cos(2 * math.pi * step / 30)) / 2
        rows.append(f"{0.9 * math.sin(2 * math.pi * step / 30):.3f},{3 * fold:.3f}")
    (folder / "path.csv").write_text("\n".join(rows) + "\n")
    subprocess.run([programs / "hullctl", "view", "arm.urdf", "--joints", "path.csv", "--html",
                    target.name], cwd=folder, check=True)
    for name in ("arm.urdf", "path.csv"):
        (folder / name).unlink()


def main():
    hulld = viewing.Hulld(viewing.bin_directory())
    target = pathlib.Path(sys.argv[1])
    try:
        write_page(hulld.programs, target / "arm.html")
        moved = ("(hulldViewer.model.setPose(1, [0.9659258262890683, 0, 0.25881904510252074, 0, "
                 "{}], true), hulldViewer.fit())")
        demo = ["--demo", "--scene"]
        take(hulld, target / "view.png", [*demo, "0"], 1160, 700, before=moved.format("165, 20, -10"))
        take(hulld, target / "view-overlap.png", [*demo, "1"], 1160, 700)
        take(hulld, target / "view-phone.png", [*demo, "2"], 390, 844, dark=True)
        hulld.hullctl("append", "spider", "/usr/share/assimp/models/OBJ/spider.obj", "--create")
        pathlib.Path(hulld.directory, "motion.yaml").write_text(MOTION)
        hulld.hullctl("scene", "apply", "motion.yaml")
        take(hulld, target / "view-motion.png", ["motion.yaml"], 1160, 700,
             before="hulldViewer.timeLine.jumpTo(0.25)")
    finally:
        hulld.stop()


if __name__ == "__main__":
    main()
