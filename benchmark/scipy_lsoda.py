#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The rig of config/sarkar_1997.yaml by scipy's LSODA, as one would write it in Python: cost at a measured error.

Prints JSON in the form of Google Benchmark: CPU milliseconds and error (rms over rms, against LSODA at 1e-12) for each
tolerance; the same work as one_rig in integration.cpp.
"""
import json
import math
import time
from pathlib import Path

import numpy as np
import yaml
from scipy.integrate import solve_ivp

RATE, DURATION, HALF_GAP = 1000, 0.5, 50e-6


def equations(rig):
    train = rig["gear_train"]
    j_motor, j_pinion, j_gear = (float(train[part]["inertia"]) for part in ("motor", "pinion", "gear"))
    viscous = train["motor"]["viscous_damping"]
    k_in, c_in = train["input_coupling"]["stiffness"], train["input_coupling"]["damping"]
    k_out, c_out = train["output_coupling"]["stiffness"], train["output_coupling"]["damping"]
    radius = train["mesh"]["base_radius"]
    stiffness, alpha = (float(train["mesh"]["contact"][key]) for key in ("stiffness", "alpha"))  # 2.28e8: text to PyYAML

    def rates(_, s, torque):
        motor = k_in * (s[0] - s[1]) + c_in * (s[3] - s[4])
        x = radius * (s[1] - s[2])
        depth, force = abs(x) - HALF_GAP, 0.0
        if depth > 0:
            side = math.copysign(1, x)
            rate = side * radius * (s[4] - s[5])
            force = side * stiffness * depth**1.5 * max(0.0, 1 + 1.5 * alpha * rate)
        out = k_out * s[2] + c_out * s[5]
        return [s[3], s[4], s[5], (torque - viscous * s[3] - motor) / j_motor, (motor - radius * force) / j_pinion,
                (radius * force - out) / j_gear]

    return rates, k_in


def simulate(rig, tolerance):
    rates, stiffness = equations(rig)
    excitation = rig["excitation"]
    half, state, values = 0.5 / excitation["frequency"], np.zeros(6), []
    per_half = round(half * RATE)
    for segment in range(round(DURATION / half)):
        torque = excitation["amplitude"] * (1 if segment % 2 == 0 else -1)
        times = segment * half + np.arange(per_half + 1) / RATE
        found = solve_ivp(rates, (times[0], times[-1]), state, "LSODA", t_eval=times, rtol=tolerance,
                          atol=1e-2 * tolerance, args=(torque,))
        values.append(stiffness * (found.y[0] - found.y[1])[:-1])
        state = found.y[:, -1]
    return np.concatenate(values)


def main():
    rig = yaml.safe_load((Path(__file__).resolve().parents[1] / "config/sarkar_1997.yaml").read_text(encoding="utf-8"))
    right = simulate(rig, 1e-12)
    results = []
    for decade in range(4, 10):
        started = time.process_time()
        found = simulate(rig, 10.0**-decade)
        seconds = time.process_time() - started
        error = float(np.linalg.norm(found - right) / np.linalg.norm(right))
        results.append({"name": f"one_rig/scipy_lsoda/1e-{decade:02d}", "cpu_time": 1e3 * seconds, "time_unit": "ms",
                        "error": error})
    print(json.dumps({"benchmarks": results}))


if __name__ == "__main__":
    main()
