#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The measured arm by a least-squares script of the usual kind on the dynamics of MuJoCo or KDL, and by this package.

The script is what people write for a simulator: positions low-passed and differentiated, torque = current times the
declared constant, the regressor of the simulator's inverse dynamics with the friction that MuJoCo's joint has (Coulomb,
viscous), an offset and the rotor's inertia, all low-passed and decimated, each joint weighted by its residual (IDIM-WLS:
Gautier and Poignet 2001). What the motion does not show keeps the values of the URDF. Prints the tables of doc/peers.md.
Exit code: 0, 64 usage.
"""
import argparse
import json
import os
import subprocess
import tempfile
import xml.etree.ElementTree
from pathlib import Path

import numpy
import scipy.signal

import confusion_table

RIG = confusion_table.REPOSITORY / "config/ur10e_arm/ur10e_arm.yaml"
URDF = RIG.with_suffix(".urdf")
JOINTS = [name + "_joint" for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")]
CONSTANTS = numpy.array([10.0, 10.70, 8.46, 9.00, 9.48, 10.12])  # N m/A, as the rig file declares
RATE, MOTION, TORQUE = 100.0, 10.0, 5.0  # Hz: of the records; cutoffs of the rig file
SLOWEST = 0.02  # rad/s, of the rig file
DECIMATE = 8  # to 12.5 Hz: 2.5 times the cutoff
SHOWN = 1e-4  # of the largest singular value: a smaller one is not shown; choice of the script
ZERO = 1e-9  # of the largest column: a smaller one is rounding
TRUTH, DRIVES = 2.805, 4  # kg of the body of `payload`; terms of a drive


def cpu_time():
    """Seconds of the processor, of this script and of what it has run."""
    return sum(os.times()[:4])


def low_pass(values, cutoff):
    return scipy.signal.filtfilt(*scipy.signal.butter(4, cutoff / (RATE / 2)), values, axis=0)


class Run:
    """A record as rows of the regression: columns of links, then of drives, and torques, a joint after the other."""

    def __init__(self, path, columns, peer, half=None):
        names = path.read_text(encoding="utf-8").split("\n", 1)[0].split(",")
        table = numpy.loadtxt(path, delimiter=",", skiprows=1)
        middle = (table[0, 0] + table[-1, 0]) / 2
        if half is not None:
            table = table[(table[:, 0] > middle) == bool(half)]
        grid = numpy.arange(table[0, 0], table[-1, 0], 1 / RATE)

        def channel(name):
            picked = [names.index(f"{joint}/{name}") for joint in JOINTS]
            return numpy.stack([numpy.interp(grid, table[:, 0], table[:, c]) for c in picked], 1)

        q = low_pass(channel("motor_position"), MOTION)
        v = numpy.gradient(q, 1 / RATE, axis=0)
        a = numpy.gradient(v, 1 / RATE, axis=0)
        states = numpy.ascontiguousarray(numpy.hstack([q, v, a]))
        done = subprocess.run([columns, peer, URDF, *JOINTS], input=states.tobytes(), stdout=subprocess.PIPE, check=True)
        links = numpy.frombuffer(done.stdout).reshape(len(grid), len(JOINTS), -1)
        torque = channel("motor_current") * CONSTANTS
        self.raw = links[::DECIMATE]
        kept = slice(int(RATE / TORQUE), -int(RATE / TORQUE), DECIMATE)  # without the ends of the filter
        self.links, self.drives, self.torque, self.moves = [], [], [], []
        for j in range(len(JOINTS)):
            drive = numpy.stack([numpy.sign(v[:, j]), v[:, j], numpy.ones(len(grid)), a[:, j]], 1)
            moves = numpy.abs(v[kept, j]) > SLOWEST
            self.links.append(low_pass(links[:, j], TORQUE)[kept][moves])
            self.drives.append(low_pass(drive, TORQUE)[kept][moves])
            self.torque.append(low_pass(torque[:, j], TORQUE)[kept][moves])

    def rows(self, j, extra):
        """Columns of joint j: links, all drives, and `extra` times the last link once more: a body on it."""
        drives = numpy.zeros((len(self.torque[j]), DRIVES * len(JOINTS)))
        drives[:, DRIVES * j: DRIVES * (j + 1)] = self.drives[j]
        return numpy.hstack([self.links[j], drives, extra * self.links[j][:, -10:]])


def start():
    """The masses of ten points per link that are the bodies of the URDF."""
    root = xml.etree.ElementTree.parse(URDF).getroot()
    places = numpy.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [1, 1, 0],
                          [1, 0, 1], [0, 1, 1]], float)
    moments = numpy.stack([second_moments(1, place, numpy.zeros((3, 3))) for place in places], 1)
    out = []
    for joint in JOINTS:
        name = root.find(f"joint[@name='{joint}']/child").get("link")
        body = root.find(f"link[@name='{name}']/inertial")
        i = {k: float(x) for k, x in body.find("inertia").items()}
        inertia = numpy.array([[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]])
        centre = numpy.array([float(x) for x in body.find("origin").get("xyz").split()])
        out.append(numpy.linalg.solve(moments, second_moments(float(body.find("mass").get("value")), centre, inertia)))
    return numpy.concatenate(out), moments


def second_moments(mass, centre, inertia):
    """m, m c and the six second moments of mass of a body: those of points add up."""
    second = 0.5 * numpy.trace(inertia) * numpy.eye(3) - inertia + mass * numpy.outer(centre, centre)
    return numpy.concatenate([[mass], mass * centre, second[numpy.triu_indices(3)]])


def is_physical(moments):
    p = numpy.empty((4, 4))
    p[3, 3], p[3, :3], p[:3, 3] = moments[0], moments[1:4], moments[1:4]
    p[numpy.triu_indices(3)] = moments[4:]
    p[:3, :3] = numpy.triu(p[:3, :3]) + numpy.triu(p[:3, :3], 1).T
    return numpy.linalg.eigvalsh(p)[0] > 0


def fit(runs, with_body=()):
    """Values and covariance of the weighted least squares, in two passes: the first weighs the joints alike."""
    initial = numpy.concatenate([start()[0], numpy.zeros(DRIVES * len(JOINTS) + 10)])
    blocks = [numpy.vstack([run.rows(j, run in with_body) for run in runs]) for j in range(len(JOINTS))]
    torques = [numpy.concatenate([run.torque[j] for run in runs]) for j in range(len(JOINTS))]
    deviation = numpy.ones(len(JOINTS))
    for _ in range(2):
        rows = numpy.vstack([block / s for block, s in zip(blocks, deviation)])
        right = numpy.concatenate([(torque - block @ initial) / s for block, torque, s in zip(blocks, torques, deviation)])
        scale = numpy.linalg.norm(rows, axis=0)
        scale[scale < ZERO * scale.max()] = 1
        u, s, vt = numpy.linalg.svd(rows / scale, full_matrices=False)
        shown = s > SHOWN * s[0]
        values = initial + vt[shown].T @ ((u.T[shown] @ right) / s[shown]) / scale
        deviation = numpy.array([numpy.std(t - b @ values) for b, t in zip(blocks, torques)])
    inverse = (vt[shown].T / s[shown]) / scale[:, None]
    return values, inverse @ inverse.T


def errors(run, values):
    return [numpy.linalg.norm(run.torque[j] - run.rows(j, 0) @ values) / numpy.linalg.norm(run.torque[j] - run.torque[j].mean())
            for j in range(len(JOINTS))]


def script(args, peer):
    began = cpu_time()
    run = {name: Run(args.data / f"ur5_arm_{name}.csv", args.columns, peer) for name in ("a", "b", "free", "payload")}
    print(f"{peer}: {cpu_time() - began:.1f} s to read and for the columns")
    for trained, unseen in ((("a", "b"), "free"), (("b", "free"), "a"), (("a", "free"), "b")):
        began = cpu_time()
        values, _ = fit([run[name] for name in trained])
        physical = [is_physical(start()[1] @ values[10 * i: 10 * i + 10]) for i in range(len(JOINTS))]
        print(f"{peer} {'+'.join(trained)} on {unseen}:", " ".join(f"{e:.4f}" for e in errors(run[unseen], values)),
              f"{sum(physical)} of 6 links physical, {cpu_time() - began:.1f} s")
    mass("whole records", [run["payload"], run["free"]], [run["payload"]])
    halves = [[Run(args.data / f"ur5_arm_{name}.csv", args.columns, peer, half) for name in ("payload", "free")]
              for half in (0, 1)]
    first, second = (mass(label, records, records[:1]) for label, records in zip(("first halves", "second halves"), halves))
    print(f"{peer} second half, scaled by the first: {TRUTH * second[0] / first[0]:.3f} +- "
          f"{TRUTH * second[0] / first[0] * numpy.hypot(second[1] / second[0], first[1] / first[0]):.3f} kg")
    return run["free"].raw


def mass(label, runs, with_body):
    values, covariance = fit(runs, with_body)
    points = numpy.zeros(len(values))
    points[-10:] = 1  # the mass of a body is that of its points
    error = numpy.sqrt(points @ covariance @ points)
    print(f"mass by {label}: {points @ values:.3f} +- {error:.3f} kg")
    return points @ values, error


def package(args):
    records = {name: str(args.data / f"ur5_arm_{name}.csv") for name in ("a", "b", "free", "payload")}
    with tempfile.TemporaryDirectory() as folder:
        def run(tool, *arguments):
            began = cpu_time()
            subprocess.run([args.bin / tool, *arguments], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                           check=False)
            return cpu_time() - began
        for trained, unseen in ((("a", "b"), "free"), (("b", "free"), "a"), (("a", "free"), "b")):
            seconds = run("identify", *[records[name] for name in trained], "--rig", RIG, "--out", "fitted.yaml", "--json",
                          "fit.json")
            run("trace_residual", "--rig", "fitted.yaml", "--train", records[trained[0]], "--test", records[unseen], "--out",
                "out")
            report = json.loads((Path(folder) / "out/report.json").read_text())
            print(f"package {'+'.join(trained)} on {unseen}:",
                  " ".join(f"{report['channels'][f'{joint}/torque']['before']:.4f}" for joint in JOINTS), f"{seconds:.1f} s")
        seconds = run("identify", records["payload"], records["free"], "--payload", "unknown", "--rig", RIG, "--out",
                      "p.yaml", "--json", "p.json")
        body = json.loads((Path(folder) / "p.json").read_text())["payloads"][0]["mass"]
        print(f"package mass: {body['value']:.3f} +- {body['standard_error']:.3f} kg, {seconds:.1f} s")
        halves = []
        for name in ("payload", "free"):
            head, *rows = Path(records[name]).read_text(encoding="utf-8").splitlines()
            middle = (float(rows[0].split(",")[0]) + float(rows[-1].split(",")[0])) / 2
            for half in (0, 1):
                halves.append(Path(folder) / f"{name}{half}.csv")
                kept = [row for row in rows if (float(row.split(",")[0]) > middle) == bool(half)]
                halves[-1].write_text("\n".join([head, *kept]) + "\n", encoding="utf-8")
        run("identify", *halves, "--payload", f"{halves[0]}={TRUTH} kg +- 0.005", "--payload", f"{halves[1]}=unknown", "--rig",
            RIG, "--out", "h.yaml", "--json", "h.json")
        for body in json.loads((Path(folder) / "h.json").read_text())["payloads"]:
            print(f"package, {Path(body['record']).name}: {body['mass']['value']:.3f} +- {body['mass']['standard_error']:.3f} kg")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("bin", type=Path, help="folder of the package's executables and of peer_columns")
    parser.add_argument("data", type=Path, help="folder of the records ur5_arm_*.csv")
    args = parser.parse_args()
    args.bin, args.data = args.bin.resolve(), args.data.resolve()
    args.columns = args.bin / "peer_columns"
    columns = [script(args, peer) for peer in ("mujoco", "kdl")]
    print(f"MuJoCo and KDL differ by {numpy.abs(columns[0] - columns[1]).max():.1e} of {numpy.abs(columns[0]).max():.0f} N m")
    package(args)


if __name__ == "__main__":
    main()
