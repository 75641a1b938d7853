#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What demo.sh prints and draws, from the files that the commands of each act wrote.

usage: demo_report.py ACT FILE...; exit code 1 of `lost` and `fitted` is a no.
"""
import json
import os
import re
import sys

import yaml

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
MICRO = 1e6
FIT_TAKES = 2.5  # s of samples that the fit of the whole motion looks at, and a bit
SHOWN = ("apd_skewness", "apd_shape", "lost_motion", "position_difference", "momentum_transfer", "waveform")
# Parameter of identify, what it is called here, its place in the rig file, its unit
VALUES = (("motor_inertia", "motor inertia", ("motor", "inertia"), "kg m^2"),
          ("motor_viscous", "motor damping", ("motor", "viscous_damping"), "N m s/rad"),
          ("sensor_stiffness", "sensor stiffness", ("input_coupling", "stiffness"), "N m/rad"),
          ("contact_loss", "loss of the teeth", ("mesh", "contact", "alpha"), "s/m"))


def load_yaml(path):
    with open(path, encoding="utf-8") as stream:
        return next(document for document in yaml.load_all(stream, yaml.CSafeLoader) if document)


def load_json(path):
    with open(path, encoding="utf-8") as stream:
        return json.load(stream)


def at(rig, place):
    value = load_yaml(rig)["gear_train"]
    for key in place:
        value = value[key]
    return value


def lost(bag, rate):
    """0 where every sample of the bag is there."""
    import rosbag
    with rosbag.Bag(bag) as opened:
        stamps = [message.header.stamp.to_sec() for _, message, _ in opened.read_messages("/joint_states")]
    steps = [b - a for a, b in zip(stamps, stamps[1:])]
    missing = sum(round(step * float(rate)) - 1 for step in steps)
    print("   %s: %d samples in %.1f s, %d lost" % (os.path.basename(bag), len(stamps), stamps[-1] - stamps[0], missing))
    return 1 if missing else 0


def commissioned(fit, declared, machine, backlash):
    found = load_json(fit)["parameters"]
    print("   %-18s %10s %22s %12s" % ("", "rig file", "found", "machine"))
    for name, words, place, unit in VALUES:
        print("   %-18s %10.4g %11.4g +- %-8.2g %11.4g  %s"
              % (words, at(declared, place), found[name]["value"], found[name]["standard_error"], at(machine, place), unit))
    print("   %-18s %10.4g %11.4g +- %-8.2g %11.4g  um"
          % ("backlash", 2 * MICRO * at(declared, ("mesh", "half_gap")), MICRO * found["backlash"]["value"],
             MICRO * found["backlash"]["standard_error"], MICRO * float(backlash)))
    return 0


def curve(path):
    points = load_yaml(path)["points"]
    print("   from %.2f at %.0f um to %.2f at %.0f um, %d points"
          % (float(points[0]["skewness"]), MICRO * float(points[0]["backlash"]), float(points[-1]["skewness"]),
             MICRO * float(points[-1]["backlash"]), len(points)))
    return 0


def estimates_of(answer):
    return {e["method"]: e for e in answer["estimates"]}


def interval(e):
    low, value, high = (MICRO * float(e[key]) for key in ("lower", "backlash", "upper"))
    return "%.1f [%.1f, %.1f]" % (value, low, high) if value == value else e["status_name"]


def fitted(path, since):
    """0 where the background fit of the whole motion is of samples of the last `since` seconds."""
    message = estimates_of(load_yaml(path))["waveform"]["message"]
    ended = re.search(r"ended ([0-9.]+) s before", message)
    return 0 if "being fitted" not in message and float(ended.group(1) if ended else 0) + FIT_TAKES <= float(since) else 1


def answer(path, true):
    found = load_yaml(path)
    methods = estimates_of(found)
    print("   %5.0f um: skewness %s, lost motion %s, verdict: %s, %s"
          % (MICRO * float(true), interval(methods["apd_skewness"]), interval(methods["lost_motion"]),
             found["verdict"]["grade"], interval(found["verdict"])))
    return 0


def offline(path):
    verdict = load_json(path)["verdict"]
    low, high = (MICRO * v for v in verdict["interval"])
    print("   The same from the recorded bag, offline, with diagnose_record: %s, %.1f [%.1f, %.1f] um"
          % (verdict["grade"], MICRO * verdict["backlash"], low, high))
    return 0


def traced(path):
    report = load_json(path)
    for step in report["steps"]:
        values = ", ".join("%s %.4g +- %.2g" % (name, p["value"], p["standard_error"]) for name, p in step["parameters"].items())
        print("   The model lacks %s (%s)." % (step["effect"], values))
    torque = report["channels"]["torque"]
    print("   Error of the predicted torque, unseen record: %.2f %% before, %.2f %% with it, %.2f %% noise alone."
          % tuple(100 * torque[key] for key in ("before", "after", "floor")))
    return 0


def draw_torque(axes, recorded):
    for bag, words, colour in recorded:
        import rosbag
        with rosbag.Bag(bag) as opened:
            rows = [(m.header.stamp.to_sec(), dict(zip(m.name, m.effort)))
                    for _, m, _ in opened.read_messages("/joint_states")]
        start = rows[0][0]
        shown = [(1e3 * (t - start), effort["joint_sensor"]) for t, effort in rows if t - start < 0.2]
        axes.plot(*zip(*shown), lw=0.7, color=colour, label=words)
    axes.set(title="1, 4  Torque of the joint, new and worn", xlabel="time [ms]", ylabel="sensor torque [N m]")
    axes.legend(loc="upper right", fontsize=8)


def draw_values(axes, declared, machine):
    found = load_json("fit.json")["parameters"]
    for row, (name, words, place, _) in enumerate(VALUES):
        true = at(machine, place)
        axes.plot(at(declared, place) / true, row, "o", color="0.6", label="rig file" if row == 0 else None)
        axes.errorbar(found[name]["value"] / true, row, xerr=2 * found[name]["standard_error"] / true, fmt="o", capsize=4,
                      color="tab:blue", label="identified, 95 %" if row == 0 else None)
    axes.axvline(1, color="k", ls=":", label="machine")
    axes.set_yticks(range(len(VALUES)), [words for _, words, _, _ in VALUES])
    axes.set_ylim(-0.6, len(VALUES) + 0.4)
    axes.set(title="2  Commissioned: values over those of the machine", xlabel="value / true value [-]")
    axes.legend(loc="upper center", fontsize=8, ncol=3)


def draw_curve(axes, answers):
    points = load_yaml("curve.yaml")["points"]
    x = [MICRO * float(p["backlash"]) for p in points]
    y, scatter = ([float(p[key]) for p in points] for key in ("skewness", "scatter"))
    axes.fill_between(x, [a - 2 * s for a, s in zip(y, scatter)], [a + 2 * s for a, s in zip(y, scatter)],
                      color="tab:blue", alpha=0.15, lw=0)
    axes.plot(x, y, color="tab:blue", lw=1, label="monitoring curve, 2 standard deviations")
    moving = [(MICRO * float(true), float(estimates_of(load_yaml(path))["apd_skewness"]["skewness"])) for path, true in answers]
    axes.plot(*zip(*moving), "o--", color="tab:red", lw=0.8, label="the joint as it wears, at its true backlash")
    axes.set(title="3, 4  It wears along its curve", xlabel="backlash [um]", ylabel="skewness of the APD [-]")
    axes.legend(loc="upper right", fontsize=8)


def draw_answers(axes, answers):
    from matplotlib import cm
    for k, method in enumerate(SHOWN):
        rows = [(MICRO * float(true), estimates_of(load_yaml(path))[method]) for path, true in answers]
        rows = [(true, *(MICRO * float(e[key]) for key in ("lower", "backlash", "upper"))) for true, e in rows
                if float(e["backlash"]) == float(e["backlash"])]
        if not rows:
            continue
        true, low, value, high = zip(*rows)
        shift = 1.6 * (k - (len(SHOWN) - 1) / 2)
        axes.errorbar([t + shift for t in true], value, fmt="o", ms=3, capsize=2, lw=1, color=cm.tab10(k), label=method,
                      yerr=[[v - a for v, a in zip(value, low)], [b - v for v, b in zip(value, high)]])
    most = MICRO * float(answers[-1][1])
    axes.plot([0, 1.1 * most], [0, 1.1 * most], color="k", ls=":", lw=0.8, label="true")
    axes.set(title="4  Service: every method, with its 95 % interval", xlabel="true backlash [um]", ylabel="estimated [um]")
    axes.set_ylim(0, 1.9 * most)
    axes.legend(loc="upper left", fontsize=8, ncol=2)


def draw_trace(axes):
    channels = load_json("trace/report.json")["channels"]
    names = list(channels)
    for k, (key, words, colour) in enumerate((("before", "as declared", "0.6"), ("after", "with what was found", "tab:blue"),
                                              ("floor", "noise alone", "tab:green"))):
        bars = axes.bar([i + 0.27 * (k - 1) for i in range(len(names))], [100 * channels[n][key] for n in names], 0.25,
                        color=colour, label=words)
        axes.bar_label(bars, fmt="%.2g", fontsize=8)
    step = load_json("trace/report.json")["steps"]
    axes.set_yscale("log")
    axes.set_xticks(range(len(names)), names)
    axes.set(title="5  The model lacked: %s" % (step[0]["effect"] if step else "nothing"), ylabel="error, unseen record [%]")
    axes.set_ylim(top=30)
    axes.legend(loc="upper left", fontsize=8)


def draw_residual(axes):
    series = load_json("trace/series.json")
    time, torque = series["coordinates"]["time"]["values"], series["channels"]["torque"]
    shown = [i for i, t in enumerate(time) if t - time[0] < 2 and torque["before"][i] is not None]
    for key, words, colour in (("before", "as declared", "0.6"), ("after", "with what was found", "tab:blue")):
        axes.plot([time[i] for i in shown], [torque[key][i] for i in shown], lw=0.8, color=colour, label=words)
    axes.set(title="5  Torque that the model does not explain", xlabel="time [s]", ylabel="residual [N m]")
    axes.legend(loc="upper right", fontsize=8)


def picture(path, declared, machine, *answers):
    import plotting
    plt = plotting.pyplot()
    pairs = list(zip(answers[::2], answers[1::2]))
    figure, axes = plt.subplots(2, 3, figsize=(16, 8.4), constrained_layout=True)
    draw_torque(axes[0][0], (("new.bag", "new, %.0f um" % (MICRO * float(pairs[0][1])), "tab:blue"),
                             ("worn.bag", "worn, %.0f um" % (MICRO * float(pairs[-1][1])), "tab:red")))
    draw_values(axes[0][1], declared, machine)
    draw_curve(axes[0][2], pairs)
    draw_answers(axes[1][0], pairs)
    draw_trace(axes[1][1])
    draw_residual(axes[1][2])
    for a in axes.flat:
        a.grid(True, alpha=0.3)
    plotting.save(figure, path, 90)
    return 0


ACTS = {act.__name__: act for act in (lost, commissioned, curve, fitted, answer, offline, traced, picture)}

if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in ACTS:
        sys.exit("usage: demo_report.py %s FILE..." % "|".join(ACTS))
    sys.exit(ACTS[sys.argv[1]](*sys.argv[2:]))
