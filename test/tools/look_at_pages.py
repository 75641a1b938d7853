#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Opens pages in a headless Chromium and reports, as JSON, what is there to be seen; who calls it judges.

usage: look_at_pages.py PAGE.html... [--screenshots DIR]

Exit codes: 0 looked, 77 no Chromium, no driver or no selenium (the reason is on standard error).
"""
import argparse
import json
import os
import sys
import tempfile

BROWSER, DRIVER = "/usr/bin/chromium", "/usr/bin/chromedriver"
WIDTHS = (1200, 400)  # px: a desk and a phone

# What an image shows: its size, how many colours, the share of pixels of the most frequent one, and that of pixels which
# are not grey: curves are, axes and words are not.
PLOTS = """
return Promise.all(Array.from(document.images, async image => {
  await image.decode().catch(() => null);
  const canvas = document.createElement('canvas');
  canvas.width = image.naturalWidth;
  canvas.height = image.naturalHeight;
  const box = image.getBoundingClientRect();
  const seen = {alt: image.alt, width: canvas.width, height: canvas.height, shown: [box.width, box.height]};
  if (!canvas.width || !canvas.height) return {...seen, colours: 0, background: 1, coloured: 0};
  const context = canvas.getContext('2d');
  context.drawImage(image, 0, 0);
  const bytes = context.getImageData(0, 0, canvas.width, canvas.height).data;
  const pixels = new Uint32Array(bytes.buffer), counts = new Map();
  for (const pixel of pixels) counts.set(pixel, (counts.get(pixel) || 0) + 1);
  let coloured = 0;
  for (let i = 0; i < bytes.length; i += 4) {
    const rgb = [bytes[i], bytes[i + 1], bytes[i + 2]];
    coloured += Math.max(...rgb) - Math.min(...rgb) > 60;
  }
  return {...seen, colours: counts.size, background: Math.max(...counts.values()) / pixels.length,
          coloured: coloured / pixels.length};
}));
"""
TABLES = """
return Array.from(document.querySelectorAll('table'), table => Array.from(table.rows, row =>
  Array.from(row.cells, cell => cell.innerText)));
"""


def give_up(reason):
    sys.stderr.write("look_at_pages: %s\n" % reason)
    sys.exit(77)


def browser(profile, reached=()):
    """`reached`: hosts that the pages may load from; the outside is out of reach."""
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service
    options = Options()
    options.binary_location = BROWSER
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
                     "--disable-background-networking", "--no-first-run", "--user-data-dir=" + profile,
                     "--host-resolver-rules=" + ", ".join(["MAP * ~NOTFOUND"] + ["EXCLUDE " + host for host in reached])):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(service=Service(DRIVER), options=options)
    driver.set_page_load_timeout(60)
    driver.set_script_timeout(60)
    return driver


def requests(driver):
    """Addresses that the page asked for since the log was last read, without what it holds itself."""
    for entry in driver.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            url = message["params"]["request"]["url"]
            if not url.startswith("data:"):
                yield url


def set_width(driver, width):
    """Of the page itself: a headless window does not get narrower than some 500 px."""
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                           {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False})


def look(driver, path, screenshots):
    driver.get("about:blank")  # what the browser itself opened, and the page before, end here
    driver.get_log("performance"), driver.get_log("browser")
    set_width(driver, WIDTHS[0])
    driver.get("file://" + os.path.abspath(path))
    seen = {"page": path, "title": driver.title, "plots": driver.execute_script(PLOTS),
            "tables": driver.execute_script(TABLES)}
    seen["text"] = driver.execute_script("return document.body.innerText")
    seen["command"] = driver.execute_script("return document.getElementById('command').textContent")
    seen["too_wide"] = {}  # px by which the page is wider than the window
    for width in WIDTHS:
        set_width(driver, width)
        seen["too_wide"][str(width)] = driver.execute_script(
            "return document.documentElement.scrollWidth - document.documentElement.clientWidth")
        if screenshots:
            height = driver.execute_script("return document.documentElement.scrollHeight")
            driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                   {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})
            name = os.path.splitext(os.path.basename(path))[0]
            driver.save_screenshot(os.path.join(screenshots, "%s_%d.png" % (name, width)))
    seen["console"] = [entry["message"] for entry in driver.get_log("browser")]
    seen["requests"] = list(requests(driver))
    return seen


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pages", nargs="+", metavar="PAGE.html")
    parser.add_argument("--screenshots", metavar="DIR", help="keep a picture of each page and width there")
    arguments = parser.parse_args()
    for program in (BROWSER, DRIVER):
        if not os.access(program, os.X_OK):
            give_up("%s is not installed (Debian: chromium, chromium-driver)" % program)
    try:
        import selenium  # noqa: F401
    except ImportError as error:
        give_up("%s (Debian: python3-selenium)" % error)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        driver = browser(profile)
        try:
            seen = [look(driver, page, arguments.screenshots) for page in arguments.pages]
        finally:
            driver.quit()
    json.dump(seen, sys.stdout)


if __name__ == "__main__":
    main()
