#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What may happen to fleet_report: killed clients and workers, commands that crash or hang, a cluster; all refusals; its page."""
import os
import shutil
import signal
import subprocess
import sys

import rostest
from fleet_support import JOINTS, MAP, PACKAGE, SOURCE, WEEKS, FleetTest


class FleetReportFaultsTest(FleetTest):
    def test_a_record_that_kills_every_worker_is_a_row(self):
        count = self.records(2)
        name = sorted(os.listdir(self.path("records/cell1/worn")))[1]
        self.run_fleet(*self.stand_in("[[ $1 == */worn/%s ]] && kill -9 $PPID" % name))
        rows = self.rows()
        self.assertEqual(len(rows), count)
        bad = [row for row in rows if row["status"] != "done"]
        self.assertEqual([row["name"] for row in bad], ["cell1/worn/" + name])
        self.assertEqual(bad[0]["status"], "crashed")
        self.assertIn("the worker died", bad[0]["reason"])

    def test_a_killed_client_goes_on_where_it_was(self):
        count = self.records(6)
        after = 8
        ended = self.run_fleet(*self.stand_in(self.once_after(after, "KILL")))
        self.assertEqual(ended.returncode, -signal.SIGKILL)
        self.assertFalse(os.path.exists(self.path("out/fleet.json")))
        kept = {row["name"] for row in self.rows("name", "status = 'done'")}
        first = self.calls()
        self.assertGreaterEqual(len(first), after)
        self.assertLessEqual(kept, set(first))
        self.run_fleet(*self.stand_in())
        self.assert_whole(count)
        second = self.calls()
        self.assertEqual(len(set(second)), len(second))
        self.assertEqual(set(second), {row["name"] for row in self.rows()} - kept)

    def test_commands_that_crash_or_hang_are_rows_until_asked_again(self):
        count = self.records(2)
        before = "case $1 in */worn/*) kill -SEGV $$ ;; */ageing/*) exec sleep 600 ;; esac"
        self.run_fleet(*self.stand_in(before), "--time-limit", "6", code=3)
        rows = self.rows()
        self.assertEqual(len(rows), count)
        for row in rows:
            self.assertEqual(row["status"], {"cell1/worn": "crashed", "cell1/ageing": "timed_out", "cell2/still": "done"}[
                row["joint"]], row["reason"])
        self.assertIn("signal 11", [row["reason"] for row in rows if row["joint"] == "cell1/worn"][0])
        self.calls()
        self.run_fleet(*self.stand_in(), code=3)
        self.assertEqual(self.calls(), [])
        self.run_fleet(*self.stand_in(), "--retry", code=0)
        self.assertEqual(len(self.calls()), 4)
        self.assert_whole(count)

    def test_a_cluster_that_is_there(self):
        count = self.records(2)
        cluster = subprocess.Popen([sys.executable, "-c", "if __name__ == '__main__':\n"
                                    " import sys, distributed\n"
                                    " c = distributed.LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=None)\n"
                                    " print(c.scheduler_address, flush=True)\n"
                                    " sys.stdin.read()"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd="/",
                                   env=dict(os.environ, DASK_TEMPORARY_DIRECTORY=self.folder))
        try:
            address = cluster.stdout.readline().strip()
            self.run_fleet(*self.stand_in(), "--scheduler", address)
        finally:
            cluster.communicate("")
        self.assert_whole(count)
        self.assertEqual(len(self.calls()), count)

    def test_refusals_name_their_reason(self):
        self.records(1)
        name = os.listdir(self.path("records/cell1/worn"))[0]
        self.write("empty/nothing.txt", "")
        entry = "  - {match: '**', joint: all, rig: shoulder.yaml}\n"
        for text, code, reason in (
                (MAP + entry, 65, "map.yaml:6: matches cell1/ageing/%s, and so does " % name),
                (MAP + "    colour: red\n", 65, "map.yaml:6: colour: is no key here"),
                (MAP + "    time: sunday\n", 65, "map.yaml:6: time: 'sunday': must be one of"),
                (MAP.replace("}/{joint}\"", "}/{arm}\"", 1).replace("joint: \"{cell}/{arm}", "joint: \"{cell}/{leg}"), 65, "{leg}"),
                (MAP.replace("1", "2", 1), 65, "map.yaml:1: schema_version: '2': must be 1"),
                ("records: [", 65, "map.yaml:1: no YAML"),
                ("", 65, "map.yaml: is empty"),
                (MAP.replace("    rig: shoulder.yaml\n", ""), 65, "rig: is missing")):
            self.write("map.yaml", text)
            ended = self.run_fleet(code=code)
            self.assertIn(reason, ended.stderr)
            self.assertIn("fleet_report: ", ended.stderr)
        self.write("map.yaml", MAP)
        self.assertIn("there is no such folder or list", self.run_fleet(code=66, source="nowhere").stderr)
        self.assertIn("holds no record", self.run_fleet(code=66, source="empty").stderr)
        self.assertIn("is a record", self.run_fleet(code=65, source="records/cell1/worn/" + name).stderr)
        self.assertIn("see --help", self.run_fleet("--cores", "0", code=64).stderr)
        self.assertIn("does not answer", self.run_fleet("--scheduler", "tcp://127.0.0.1:1", code=66).stderr)
        self.assertIn("--scheduler", self.run_fleet("--scheduler", "nonsense://x", code=64).stderr)
        self.write("file", "")
        self.assertIn("cannot be written", self.run_fleet("--out", self.path("file/out"), code=73).stderr)
        shutil.rmtree(self.path("out"))
        self.write("out/fleet.sqlite", "no state " * 200)
        self.assertIn("is no state of fleet_report", self.run_fleet(code=65).stderr)

    def test_the_page_in_a_browser(self):
        sys.path.insert(0, os.path.join(SOURCE, "test/tools"))
        import look_at_pages
        try:
            from selenium.webdriver.common.by import By
        except ImportError as error:
            self.skipTest("%s (Debian: python3-selenium)" % error)
        if not (os.access(look_at_pages.BROWSER, os.X_OK) and os.access(look_at_pages.DRIVER, os.X_OK)):
            self.skipTest("no Chromium (Debian: chromium, chromium-driver)")
        self.records()
        self.write("records/<b>.csv", "of no joint")
        self.run_fleet()
        driver = look_at_pages.browser(self.path("profile"))
        self.addCleanup(driver.quit)
        driver.get("about:blank")
        driver.get_log("performance"), driver.get_log("browser")
        driver.get("file://" + self.path("out/fleet.html"))

        def shown():
            rows = driver.find_elements(By.CSS_SELECTOR, "#joints tbody tr")
            return [row.find_element(By.CSS_SELECTOR, ".joint").text for row in rows if row.is_displayed()]

        def press(text):
            [b for b in driver.find_elements(By.TAG_NAME, "button") if text in b.text][0].click()
        self.assertEqual(shown(), ["cell1/worn", "cell1/ageing", "cell2/still"])
        press("2 growing")
        self.assertEqual(shown(), ["cell1/worn", "cell1/ageing"])
        press("2 good")
        self.assertEqual(shown(), ["cell1/ageing"])
        press("2 growing"), press("2 good")
        driver.find_element(By.ID, "find").send_keys("CELL2")
        self.assertEqual(shown(), ["cell2/still"])
        self.assertEqual(driver.find_element(By.ID, "shown").text, "1 of 3 joints")
        driver.find_element(By.ID, "find").clear()
        driver.find_element(By.ID, "find").send_keys(" ")
        press("joint")
        self.assertEqual(shown(), ["cell1/ageing", "cell1/worn", "cell2/still"])
        press("backlash"), press("backlash")
        self.assertEqual(shown(), ["cell2/still", "cell1/ageing", "cell1/worn"])
        self.assertIn("<b>.csv", driver.find_element(By.CSS_SELECTOR, ".others").text)
        curves = driver.find_elements(By.CSS_SELECTOR, "#joints svg .dots")
        self.assertEqual(len(curves), 3)
        for curve in curves:  # a dot per record, over all of the width
            self.assertEqual(curve.get_attribute("d").count("M"), WEEKS)
            self.assertGreater(curve.rect["width"], 100)
        driver.find_element(By.LINK_TEXT, "cell1/worn").click()
        self.assertEqual(driver.title, "cell1/worn")
        rows = driver.find_elements(By.CSS_SELECTOR, "#records tbody tr")
        self.assertEqual(len(rows), WEEKS)
        self.assertIn("2026-10-12 06:00:00", rows[0].text)
        self.assertIn("service", rows[0].text)
        rows[0].find_element(By.LINK_TEXT, "report").click()
        self.assertIn("position_difference", driver.find_element(By.TAG_NAME, "body").text)
        self.assertEqual([entry["message"] for entry in driver.get_log("browser")], [])
        self.assertEqual([url for url in look_at_pages.requests(driver) if not url.startswith("file://")], [])
        for page in ("fleet.html", "joints/" + sorted(os.listdir(self.path("out/joints")))[0]):
            driver.get("file://" + self.path("out", page))
            for width in look_at_pages.WIDTHS:
                look_at_pages.set_width(driver, width)
                self.assertEqual(driver.execute_script("return document.documentElement.scrollWidth - innerWidth"), 0, page)


if __name__ == "__main__":
    rostest.rosrun(PACKAGE, "fleet_report_faults_test", FleetReportFaultsTest)
