"""Measures the viewer's page: the time to show a scene, and the time of a frame.

    /usr/bin/python3 viewer_benchmark.py BIN_DIRECTORY

Prints the rows as CSV. The page is drawn by chromium's software renderer, SwiftShader, on the
processor, as on a machine without a GPU.
"""

import pathlib
import statistics
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "client/hullctl/view"))

import viewing

viewing.skip_unless_browser()

WIDTH, HEIGHT = 1440, 900
FRAMES = 10

# Milliseconds of each frame while the camera orbits. Reading a pixel waits for the picture.
MEASURE = """
const [frames, done] = arguments;
const {stage} = hulldViewer;
const gl = stage.renderer.getContext();
const pixel = new Uint8Array(4);
const times = [];
const step = () => {
  const start = performance.now();
  stage.orbit(0.02, 0);
  stage.controls.update();
  stage.renderer.render(stage.scene, stage.camera);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  times.push(performance.now() - start);
  if (times.length < frames) setTimeout(step); else done(times);
};
step();
"""


def measure(hulld, name, *arguments):
    """Returns one row: the time from opening the page to its first picture, and of later ones."""
    viewer = hulld.view(*arguments)
    browser = viewing.Browser(WIDTH, HEIGHT)
    try:
        browser.driver.set_script_timeout(600)
        browser.driver.get(viewer.address)
        browser.wait("document.body.dataset.fitted && !hulldViewer.stage.waiting", seconds=300)
        load = browser.js("performance.now()")
        times = browser.driver.execute_async_script(MEASURE, FRAMES)
        triangles = browser.js("hulldViewer.stage.renderer.info.render.triangles")
        heap = browser.js("performance.memory.usedJSHeapSize") / 2**20
        print(f"{name},{FRAMES},{triangles},{load / 1000:.1f},{statistics.median(times):.0f},"
              f"{max(times):.0f},{heap:.0f}", flush=True)
    finally:
        browser.close()
        viewer.stop()


def main():
    hulld = viewing.Hulld(viewing.bin_directory())
    folder = pathlib.Path(hulld.directory)
    try:
        print("case,frames,triangles,load_s,median_ms,max_ms,heap_mib")
        for i in range(100):
            hulld.hullctl("generate", "sphere", "64", "--seed", str(i), "-o", "points.xyz")
            hulld.hullctl("append", f"crowd/{i}", "points.xyz", "--create")
        place = [f"  p{i}: {{id: crowd/{i % 100}, "
                 f"at: [{3 * (i % 22)}, {3 * (i // 22 % 22)}, {3 * (i // 484)}]}}"
                 for i in range(10000)]
        (folder / "crowd.yaml").write_text("place:\n" + "\n".join(place) + "\n")
        measure(hulld, "10000 hulls of 64", "crowd.yaml")
        for name, count in (("10000", 10**4), ("100000", 10**5), ("1000000", 10**6)):
            hulld.hullctl("generate", "sphere", name, "-o", "points.xyz")
            hulld.hullctl("append", f"one/{name}", "points.xyz", "--create")
            measure(hulld, f"one hull of {count}", f"one/{name}")
    finally:
        hulld.stop()


if __name__ == "__main__":
    main()
