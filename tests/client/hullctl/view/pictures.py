"""Renders the pictures of the viewer in README.md and client/guide/VIEWER.md.

    /usr/bin/python3 pictures.py BIN_DIRECTORY OUTPUT_DIRECTORY
"""

import pathlib
import sys

import viewing

viewing.skip_unless_browser()


def take(hulld, target, scene, width, height, dark=False, before="true"):
    """Renders a scene of the demo at rest, after running `before` in the page."""
    viewer = hulld.view("--demo", "--scene", scene)
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


def main():
    hulld = viewing.Hulld(viewing.bin_directory())
    target = pathlib.Path(sys.argv[1])
    try:
        moved = ("(hulldViewer.model.setPose(1, [0.9659258262890683, 0, 0.25881904510252074, 0, "
                 "{}], true), hulldViewer.fit())")
        take(hulld, target / "view.png", "0", 1160, 700, before=moved.format("165, 20, -10"))
        take(hulld, target / "view-overlap.png", "1", 1160, 700)
        take(hulld, target / "view-phone.png", "2", 390, 844, dark=True)
    finally:
        hulld.stop()


if __name__ == "__main__":
    main()
