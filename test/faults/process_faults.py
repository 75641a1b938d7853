# SPDX-License-Identifier: BSD-3-Clause
"""Processes that are killed, stopped and started again, files that change under them, disks that are full.

After each fault the running diagnoser must give the right answer or say why it cannot.
"""
import os
import random
import shutil
import signal
import subprocess
import tempfile
import threading
import time

from case import BAD, CANNOT_TELL, REFUSED, RIGHT
from clean import BACKLASH

WAIT = 60  # s of wall time; reached only when something is broken
PERIODS = 8
GROWN = 2 * BACKLASH


class NotTried(Exception):
    """What this machine does not allow."""


class Node:
    """A node of the package in a process of its own, its output in a file."""

    def __init__(self, folder, program, *arguments):
        import roslib.packages
        self.path = os.path.join(folder, "%s_%d.log" % (program, time.monotonic_ns()))
        self.command = [roslib.packages.find_node("backlash_diagnosis", program)[0]] + list(arguments)
        self.start()

    def start(self):
        with open(self.path, "a") as log:
            self.process = subprocess.Popen(self.command, stdout=log, stderr=subprocess.STDOUT)

    def kill(self):
        self.process.kill()
        self.process.wait()

    def signal(self, number):
        self.process.send_signal(number)

    def alive(self):
        return self.process.poll() is None

    def wait(self):
        return self.process.wait(WAIT)

    def output(self):
        with open(self.path) as log:
            return log.read()

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        if self.alive():
            self.kill()


def until(condition, what):
    """The first true value of the condition."""
    end = time.monotonic() + WAIT
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > end:
            raise AssertionError("%s: not within %d s" % (what, WAIT))
        time.sleep(0.05)


class Bench:
    def __init__(self, folder, master):
        import diagnoser_support as support
        import rospy
        from diagnostic_msgs.msg import DiagnosticArray
        from backlash_diagnosis.srv import Diagnose, SetBaseline
        rospy.init_node("fault_campaign", anonymous=True, disable_signals=True, log_level=rospy.FATAL)
        self.folder, self.master, self.rospy = folder, master, rospy
        self.types = {"diagnose": Diagnose, "set_baseline": SetBaseline, "diagnostics": DiagnosticArray}
        self.curve = support.build_curve(folder)

    def simulator(self, backlash=BACKLASH, *more):
        return Node(self.folder, "simulator", "_half_gap:=%g" % (backlash / 2), *more)

    def diagnoser(self, *more):
        node = Node(self.folder, "diagnoser", "_curve:=" + self.curve, *more)
        self.call("diagnose", joint="", periods=1, timeout=0)
        return node

    def call(self, name, **request):
        """Asks again where the master still names a node that was killed."""
        end = time.monotonic() + WAIT
        while True:
            self.rospy.wait_for_service("/diagnoser/" + name, WAIT)
            try:
                return self.rospy.ServiceProxy("/diagnoser/" + name, self.types[name])(**request)
            except ConnectionRefusedError:
                if time.monotonic() > end:
                    raise
                time.sleep(0.05)

    def status_says(self, words):
        """Whether any value or message on /diagnostics holds the words."""
        try:
            array = self.rospy.wait_for_message("/diagnostics", self.types["diagnostics"], 5)
        except self.rospy.ROSException:
            return False
        return any(words in text for status in array.status
                   for text in [status.message] + [value.value for value in status.values])

    def judged(self, backlash, periods=PERIODS, timeout=WAIT):
        answer = self.call("diagnose", joint="", periods=periods, timeout=timeout)
        if not answer.success:
            return CANNOT_TELL if answer.message else BAD, answer.message
        value = answer.verdict.backlash
        inside = answer.verdict.lower <= backlash <= answer.verdict.upper or abs(value / backlash - 1) < 0.05
        return RIGHT if inside else BAD, "%.4g m, true %.4g m" % (value, backlash)

    def after_new_periods(self, backlash):
        """Judged once the periods asked for have all begun after this call, by the stamps."""
        begin = self.rospy.Time.now().to_sec()
        long_enough = PERIODS * 0.1 + 0.5  # s: they and what settles before them

        def new():
            answer = self.call("diagnose", joint="", periods=1, timeout=5)
            return answer.distribution.header.stamp.to_sec() > begin + long_enough
        until(new, "whole periods after the fault")
        return self.judged(backlash)


def simulator_killed_and_restarted(bench, rng):
    with bench.simulator() as simulator, bench.diagnoser() as diagnoser:
        bench.judged(BACKLASH)
        simulator.kill()
        time.sleep(rng.choice([0, 0.5, 3]))  # what is tried: gaps shorter and longer than a new run takes
        simulator.start()
        return bench.after_new_periods(BACKLASH) if diagnoser.alive() else (BAD, diagnoser.output()[-300:])


def simulator_restarted_with_other_backlash(bench, rng):
    with bench.simulator() as simulator, bench.diagnoser() as diagnoser:
        before = bench.judged(BACKLASH)
        if before[0] == BAD:
            return before
        simulator.kill()
        time.sleep(rng.choice([0, 0.5, 3]))
        with bench.simulator(GROWN):
            return bench.after_new_periods(GROWN) if diagnoser.alive() else (BAD, diagnoser.output()[-300:])


def simulator_stopped_and_continued(bench, rng):
    with bench.simulator() as simulator, bench.diagnoser():
        bench.judged(BACKLASH)
        simulator.signal(signal.SIGSTOP)
        time.sleep(rng.choice([0.5, 3]))
        simulator.signal(signal.SIGCONT)
        return bench.after_new_periods(BACKLASH)


def diagnoser_killed_and_restarted(bench, rng):
    baseline = os.path.join(bench.folder, "killed_baseline.yaml")
    with bench.simulator(), bench.diagnoser("_baseline:=" + baseline) as diagnoser:
        bench.judged(BACKLASH)
        kept = bench.call("set_baseline", joint="", clear=False)
        diagnoser.kill()
        diagnoser.start()
        verdict = bench.after_new_periods(BACKLASH)
        answer = bench.call("diagnose", joint="", periods=PERIODS, timeout=WAIT)
        if kept.success and answer.success and not abs(answer.verdict.growth) < 0.1 * BACKLASH:
            return BAD, "the baseline is lost: growth %g m" % answer.verdict.growth
        return verdict


def diagnoser_killed_while_it_writes_its_baseline(bench, rng):
    """The file is whole or not there, whenever the kill comes."""
    baseline = os.path.join(bench.folder, "torn_baseline.yaml")
    with bench.simulator(), bench.diagnoser("_baseline:=" + baseline) as diagnoser:
        for _ in range(5):
            bench.judged(BACKLASH)
            bench.call("set_baseline", joint="", clear=False)
            writer = threading.Thread(target=write_until_killed, args=(bench,))
            writer.start()
            time.sleep(rng.uniform(0.02, 0.3))  # what is tried: any moment
            diagnoser.kill()
            writer.join(WAIT)
            diagnoser.start()
            until(lambda: not diagnoser.alive() or bench.call("diagnose", joint="", periods=1, timeout=0), "a restart")
            if not diagnoser.alive():
                return BAD, "does not start again: " + diagnoser.output()[-300:]
        return bench.after_new_periods(BACKLASH)


def write_until_killed(bench):
    import rospy
    try:
        bench.rospy.wait_for_service("/diagnoser/set_baseline", WAIT)
        proxy = bench.rospy.ServiceProxy("/diagnoser/set_baseline", bench.types["set_baseline"])
        while True:
            proxy(joint="", clear=False)
    except (rospy.ServiceException, rospy.ROSException, OSError):
        pass


def history_text(path):
    with open(path, "rb") as stream:
        return stream.read()


def torn_lines(text):
    """Lines of a history that are neither whole (the last cell is in quotes) nor the one that was cut off last."""
    return [line for line in text.split(b"\n")[1:-1] if line and not line.endswith(b'"')]


def diagnoser_killed_while_it_writes_history(bench, rng):
    """What has been written once is there for good; of the line under way at most a rest is left, which is no entry."""
    folder = os.path.join(bench.folder, "history_%d" % rng.randrange(10**9))
    os.makedirs(folder)
    path, kills = os.path.join(folder, "joint.csv"), 5
    with bench.simulator(), bench.diagnoser("_history:=" + folder, "_history_interval:=0",
                                            "_estimate_interval:=0") as diagnoser:
        lines = 3
        for _ in range(kills):
            until(lambda: os.path.exists(path) and history_text(path).count(b"\n") >= lines, "%d lines" % lines)
            time.sleep(rng.uniform(0, 0.3))  # what is tried: any moment
            before = history_text(path)
            diagnoser.kill()
            diagnoser.start()
            lines = history_text(path).count(b"\n") + 3
            if not history_text(path).startswith(before):
                return BAD, "an entry that was written is lost"
        until(lambda: history_text(path).count(b"\n") >= lines, "%d lines" % lines)
        if len(torn_lines(history_text(path))) > kills:
            return BAD, "torn lines: %s" % torn_lines(history_text(path))[:2]
        return bench.after_new_periods(BACKLASH)


def full_disk_for_the_history(bench, rng):
    """Entries wait until there is room again; what was written stays."""
    with SmallDisk(bench.folder) as disk:
        path = os.path.join(disk.path, "joint.csv")
        with bench.simulator(), bench.diagnoser("_history:=" + disk.path, "_history_interval:=0",
                                                "_estimate_interval:=0") as diagnoser:
            until(lambda: os.path.exists(path) and history_text(path).count(b"\n") >= 3, "three lines")
            disk.fill()
            until(lambda: bench.status_says("No space left"), "the full disk on /diagnostics")
            before = history_text(path)
            verdict = bench.after_new_periods(BACKLASH)
            os.remove(os.path.join(disk.path, "filler"))
            until(lambda: len(history_text(path)) > len(before) + 200, "the entries that waited")
            after = history_text(path)
            if not diagnoser.alive() or not after.startswith(before) or torn_lines(after):
                return BAD, "lines were lost or torn: " + diagnoser.output()[-300:]
            return verdict


def curve_file_changed_while_running(bench, rng):
    """What was read stays in use; what cannot be read any more is refused at the next start, by name."""
    curve = os.path.join(bench.folder, "changing_curve.yaml")
    shutil.copy(bench.curve, curve)
    with bench.simulator(), bench.diagnoser("_curve:=" + curve) as diagnoser:
        bench.judged(BACKLASH)
        how = rng.choice(["truncated", "emptied", "removed", "rubbish"])
        if how == "removed":
            os.remove(curve)
        else:
            with open(curve, "r+b") as stream:
                stream.truncate({"truncated": 2000, "emptied": 0, "rubbish": 0}[how])
                if how == "rubbish":
                    stream.write(bytes(rng.randrange(256) for _ in range(500)))
        verdict = bench.after_new_periods(BACKLASH)
        if verdict[0] == BAD:
            return verdict
        diagnoser.kill()
        diagnoser.start()
        code = diagnoser.wait()
        if code not in (65, 66) or "changing_curve.yaml" not in diagnoser.output():
            return BAD, "%s: started again it ends with %s: %s" % (how, code, diagnoser.output()[-300:])
        return verdict[0], how + ": " + verdict[1]


class SmallDisk:
    """64 KiB, full but for less than a page."""

    def __init__(self, folder):
        self.path = os.path.join(folder, "small_disk")

    def __enter__(self):
        os.makedirs(self.path, exist_ok=True)
        done = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", self.path], stderr=subprocess.PIPE)
        if done.returncode:
            raise NotTried("no tmpfs can be mounted here: " + done.stderr.decode().strip())
        return self

    def fill(self):
        with open(os.path.join(self.path, "filler"), "wb", buffering=0) as filler:
            try:
                while True:
                    filler.write(bytes(4096))
            except OSError:
                pass

    def __exit__(self, *unused):
        subprocess.run(["umount", "-l", self.path], check=True)


def full_disk_for_the_baseline(bench, rng):
    with SmallDisk(bench.folder) as disk:
        baseline = os.path.join(disk.path, "baseline.yaml")
        with bench.simulator(), bench.diagnoser("_baseline:=" + baseline) as diagnoser:
            bench.judged(BACKLASH)
            first = bench.call("set_baseline", joint="", clear=False)
            with open(baseline, "rb") as stream:
                before = stream.read()
            disk.fill()
            answer = bench.call("set_baseline", joint="", clear=False)
            with open(baseline, "rb") as stream:
                same = stream.read() == before
            if not first.success or answer.success or not same or "baseline.yaml" not in answer.message:
                return BAD, "first %s, then %s '%s', file %s" % (first.success, answer.success, answer.message,
                                                                  "kept" if same else "damaged")
            if not diagnoser.alive():
                return BAD, diagnoser.output()[-300:]
            verdict = bench.after_new_periods(BACKLASH)
            return (REFUSED, answer.message) if verdict[0] == RIGHT else verdict


def full_disk_for_the_commands(bench, rng):
    """Exit code 73 with the file's name; what was there before stays."""
    import roslib.packages
    rig = os.path.join(roslib.packages.get_pkg_dir("backlash_diagnosis"), "config", "sarkar_1997.yaml")
    name = rng.choice(["run.csv", "run.bag"])
    with SmallDisk(bench.folder) as disk:
        out = os.path.join(disk.path, name)
        with open(out, "wb") as stream:
            stream.write(b"earlier")
        disk.fill()
        program = roslib.packages.find_node("backlash_diagnosis", "simulate")[0]
        done = subprocess.run([program, rig, "--duration", "2", "--out", out], stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, timeout=WAIT)
        with open(out, "rb") as stream:
            same = stream.read() == b"earlier"
        message = done.stderr.decode()
        left = set(os.listdir(disk.path)) - {name, "filler"}
        good = done.returncode == 73 and name in message and same and not left
        return (REFUSED if good else BAD), "exit code %d, earlier file %s, left %s: %s" % (
            done.returncode, "kept" if same else "lost", left or "nothing", message[-200:])


def roscore_killed_and_restarted(bench, rng):
    """The nodes go on measuring without a master; a new one knows them again, with all that they had kept."""
    with bench.simulator() as simulator, bench.diagnoser() as diagnoser:
        bench.after_new_periods(BACKLASH)
        time.sleep(2)  # nodes look what the master knows of them each second; before that they know nothing to report
        begin = bench.call("diagnose", joint="", periods=1, timeout=5).distribution.header.stamp.to_sec()
        bench.master.kill()
        time.sleep(rng.choice([0.5, 5]))
        bench.master.start()
        verdict = bench.judged(BACKLASH, periods=PERIODS)
        kept = bench.call("diagnose", joint="", periods=0, timeout=0)
        if not (simulator.alive() and diagnoser.alive()):
            return BAD, simulator.output()[-300:] + diagnoser.output()[-300:]
        if kept.distribution.header.stamp.to_sec() <= begin:
            return BAD, "no samples since the master went away"
        return verdict


def clock_stopped(bench, rng):
    """Answers come by wall time, also where the simulated clock stands."""
    from rosgraph_msgs.msg import Clock
    bench.rospy.set_param("/use_sim_time", True)
    clock = bench.rospy.Publisher("/clock", Clock, queue_size=10, latch=True)
    try:
        with Node(bench.folder, "diagnoser", "_curve:=" + bench.curve) as diagnoser:
            clock.publish(Clock(bench.rospy.Time(1000)))
            bench.rospy.wait_for_service("/diagnoser/diagnose", WAIT)
            begin = time.monotonic()
            answer = bench.call("diagnose", joint="", periods=5, timeout=1)
            took = time.monotonic() - begin
            inbox = []
            subscriber = bench.rospy.Subscriber("/diagnostics", bench.types["diagnostics"], inbox.append)
            until(lambda: inbox, "/diagnostics while the clock stands")
            subscriber.unregister()
            if answer.success or not answer.message or not diagnoser.alive():
                return BAD, "success %s: '%s'" % (answer.success, answer.message)
            return CANNOT_TELL, "after %.1f s of wall time: %s" % (took, answer.message)
    finally:
        bench.rospy.delete_param("/use_sim_time")
        clock.unregister()


CASES = [simulator_killed_and_restarted, simulator_restarted_with_other_backlash, simulator_stopped_and_continued,
         diagnoser_killed_and_restarted, diagnoser_killed_while_it_writes_its_baseline,
         diagnoser_killed_while_it_writes_history, full_disk_for_the_history, curve_file_changed_while_running,
         full_disk_for_the_baseline, full_disk_for_the_commands, clock_stopped,
         roscore_killed_and_restarted]  # the last: rospy itself does not register again


def run(arguments, table, master):
    folder = tempfile.mkdtemp()
    try:
        bench = Bench(folder, master)
        for try_it in CASES:
            kind = "processes: " + try_it.__name__.replace("_", " ")
            if arguments.only in kind:
                run_case(arguments, table, bench, kind, try_it)
    finally:
        shutil.rmtree(folder)


def run_case(arguments, table, bench, kind, try_it):
    for number in range(max(1, arguments.count // 10)):
        if arguments.number not in (None, number):
            continue
        rng = random.Random("%d/%s/%d" % (arguments.seed, kind, number))
        try:
            verdict, why = try_it(bench, rng)
        except NotTried as reason:
            print("NOT TRIED %s: %s" % (kind, reason))
            continue
        except Exception as error:  # the campaign goes on; whatever it is, it is bad
            verdict, why = BAD, "%s: %s" % (type(error).__name__, error)
        table.add(kind, verdict, "(--seed %d --only '%s' --number %d)" % (arguments.seed, kind, number), why)
