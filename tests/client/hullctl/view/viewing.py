"""A hulld, a `hullctl view` and a browser, for tests of the viewer.

Everything runs on free ports and in a temporary directory, and is cleaned up at the end.
"""

import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile

SKIPPED = 77
CHROMIUM = shutil.which("chromium")
DRIVER = shutil.which("chromedriver")

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.support.ui import WebDriverWait
except ImportError:
    webdriver = None


def skip_unless_browser():
    """Ends the program with SKIPPED if no browser is installed."""
    missing = [name for name, there in [("chromium", CHROMIUM), ("chromium-driver", DRIVER),
                                        ("python3-selenium", webdriver)] if not there]
    if missing:
        print("skipped: not installed:", ", ".join(missing))
        sys.exit(SKIPPED)


class Process:
    """A child process with output that is read line by line up to an awaited text."""

    def __init__(self, arguments, directory):
        self.child = subprocess.Popen(arguments, cwd=directory, stdout=subprocess.PIPE,
                                      stderr=subprocess.STDOUT, text=True)
        self.said = ""

    def wait_for(self, pattern):
        for line in self.child.stdout:
            self.said += line
            found = re.search(pattern, line)
            if found:
                return found
        raise AssertionError(f"ended without saying {pattern!r}:\n{self.said}")

    def stop(self):
        if self.child.poll() is None:
            self.child.send_signal(signal.SIGTERM)
        rest, _ = self.child.communicate(timeout=600)
        self.said += rest
        return self.child.returncode


class Hulld:
    """An in-memory server, and hullctl for it."""

    def __init__(self, programs):
        self.programs = pathlib.Path(programs)
        self.directory = tempfile.mkdtemp(prefix="hulld_viewer_")
        self.address = "127.0.0.1:0"
        self.start()

    def start(self):
        """Starts the server, again at the same address after the first time."""
        self.process = Process([self.programs / "hulld", "--listen", self.address, "--data-dir",
                                self.directory + "/data"], self.directory)
        self.address = self.process.wait_for(r"listening on (\S+:\d+)")[1]

    def stop(self):
        self.process.stop()
        shutil.rmtree(self.directory)

    def command(self):
        return [self.programs / "hullctl", "--server", self.address]

    def hullctl(self, *arguments, **options):
        return subprocess.run([*self.command(), *arguments],
                              cwd=self.directory, check=True, stdout=subprocess.PIPE, text=True,
                              **options).stdout

    def json(self, *arguments, server=None):
        """Returns the output of a command; server: a different server than this one."""
        command = [self.programs / "hullctl", *arguments, "--server", server or self.address,
                   "--output", "json"]
        return json.loads(subprocess.run(command, cwd=self.directory, check=True,
                                         stdout=subprocess.PIPE, text=True).stdout)

    def add(self, hull_id, points):
        """Appends points, each a text "x y z"."""
        self.hullctl("append", hull_id, "-", "--create", input="\n".join(points) + "\n")

    def add_box(self, hull_id, size=2.0, low=(-1.0, -1.0, -1.0)):
        self.add(hull_id, [f"{low[0] + x} {low[1] + y} {low[2] + z}"
                           for x in (0, size) for y in (0, size) for z in (0, size)])

    def view(self, *arguments):
        process = Process([self.programs / "hullctl", "--server", self.address, "view",
                           "--no-open", *arguments], self.directory)
        process.address = process.wait_for(r"viewer at (http://\S+)")[1]
        return process


class Browser:
    """Chromium without a window, and the page of the viewer in it."""

    def __init__(self, width=1440, height=900, dark=False, calm=True):
        options = Options()
        options.binary_location = CHROMIUM
        # Disables animation, so that states are reached immediately.
        for argument in ["--headless=new", "--no-sandbox", "--enable-unsafe-swiftshader",
                         "--disable-dev-shm-usage", "--hide-scrollbars",
                         f"--window-size={width},{height}"]:
            options.add_argument(argument)
        if calm:
            options.add_argument("--force-prefers-reduced-motion")
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(service=Service(DRIVER), options=options)
        # Selenium's 30 s are too short for a busy machine.
        self.driver.set_script_timeout(600)
        self.driver.set_page_load_timeout(600)
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {
            "features": [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"},
                         {"name": "prefers-reduced-motion", "value": "reduce" if calm else ""}]})
        self.resize(width, height)

    def resize(self, width, height):
        """Sets the exact page size in pixels: windows have a minimum width."""
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})

    def open(self, address):
        """Opens the viewer and waits until it shows everything."""
        self.driver.get(address)
        self.wait("document.body.dataset.fitted")

    def js(self, expression, *arguments):
        return self.driver.execute_script("return " + expression, *arguments)

    def wait(self, expression, *arguments, seconds=300):
        """Waits until an expression is true, and returns it."""
        return WebDriverWait(self.driver, seconds, poll_frequency=0.05).until(
            lambda _: self.js(f"(() => {{ try {{ return {expression} }} catch {{ return null }} }})()",
                              *arguments), f"never true: {expression}")

    def text(self, selector):
        return self.js("document.querySelector(arguments[0])?.textContent ?? ''", selector)

    def fact(self, name):
        """Returns the value of a name in the answer's table; numbers in full, not rounded."""
        return self.js("""(() => {
          const term = [...document.querySelectorAll('#answer-facts dt')]
              .find((dt) => dt.textContent === arguments[0]);
          const value = term?.nextElementSibling;
          return value?.querySelector('[title]')?.title ?? value?.textContent;
        })()""", name)

    def problems(self):
        """Returns the errors of the browser's console."""
        return [entry["message"] for entry in self.driver.get_log("browser")
                if entry["level"] in ("SEVERE", "WARNING") and "GPU stall" not in entry["message"]
                and "GL Driver Message" not in entry["message"]]

    def close(self):
        self.driver.quit()


def bin_directory():
    """Removes and returns the first argument, the directory of hulld and hullctl."""
    return os.path.abspath(sys.argv.pop(1))
