# SPDX-License-Identifier: BSD-3-Clause
"""Servos of other builds than that of config/two_inertia_servo.yaml: how they are made, recorded and declared."""
import collections
import math

import yaml

# Servos that are not as that of config/two_inertia_servo.yaml: what is declared, times so much (names as make_machine
# has them), and how they are recorded.
Build = collections.namedtuple("Build", "times options", defaults=({}, ()))
BUILDS = {
    "servo": Build(),
    "light_load": Build({"load_inertia": 0.03, "load_coulomb": 0.3, "load_viscous": 0.3}),
    "light_motor": Build({"motor_inertia": 0.1, "motor_coulomb": 0.3, "motor_viscous": 0.3,
                          "loop_gain": 0.1}),
    "wide_gap": Build({"backlash_angle": 8}),
    "narrow_gap": Build({"backlash_angle": 0.15}),
    "soft_teeth": Build({"mesh_stiffness": 0.05, "mesh_damping": 0.2}),
    "stiff_teeth": Build({"mesh_stiffness": 5, "mesh_damping": 2.2}),
    "damped_teeth": Build({"mesh_damping": 6}),
    "sticky_load": Build({"load_coulomb": 10}),
    "free_load": Build({"load_coulomb": 0.03, "load_viscous": 0.1}),
    "coarse": Build({}, ("--encoder-bits", "15")),
    "slow_recorder": Build({}, ("--rate", "200")),
    "chattering": Build({"loop_gain": 4.5}),
    "short": Build({}, ("--duration", "4")),
}
PLACES = {"motor_inertia": ("motor", "inertia"), "motor_coulomb": ("motor", "coulomb_friction"),
          "motor_viscous": ("motor", "viscous_damping"), "load_inertia": ("link", "inertia"),
          "load_coulomb": ("link", "coulomb_friction"), "load_viscous": ("link", "viscous_damping"),
          "backlash_angle": ("mesh", "backlash_angle"), "mesh_stiffness": ("mesh", "contact", "stiffness"),
          "mesh_damping": ("mesh", "contact", "damping")}


def declared(build, source, folder):
    """The rig file of a build."""
    with open(source, encoding="utf-8") as file:
        rig = yaml.safe_load(file)
    for name, factor in build.times.items():
        if name not in PLACES:  # the drive's, which no rig file knows
            continue
        *path, last = PLACES[name]
        place = rig["gear_train"]
        for step in path:
            place = place[step]
        place[last] = float(place[last]) * factor
    options = dict(zip(build.options[::2], build.options[1::2]))
    if "--rate" in options:
        rig["sensors"]["sampling_rate"] = float(options["--rate"])
    if "--encoder-bits" in options:
        resolution = 2 * math.pi / 2 ** int(options["--encoder-bits"])
        rig["sensors"]["load_position"]["resolution"] = resolution
        rig["sensors"]["motor_position"]["resolution"] = resolution / 8
    path = folder / "rig.yaml"
    path.write_text(yaml.safe_dump(rig, sort_keys=False), encoding="utf-8")
    return str(path)


def of_build(build, cases):
    """The servos among the cases (as confusion_table.py has them), as the build is made and recorded; the joints too
    where it is the servo of the file."""
    times = ",".join(f"{name}={factor}" for name, factor in build.times.items())
    more = list(build.options) + (["--times", times] if times else [])
    if not more:
        return cases
    return [c._replace(options=c.options + more) for c in cases
            if c.group != "joint" and not set(c.options) & set(build.options[::2])]
