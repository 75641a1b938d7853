#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws motor minus load of a record that turns slowly one way: over two teeth, over its travel, over orders.

usage: plot_tooth_pairs.py RECORD.csv --teeth N --base-radius M --out PICTURE
"""
import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

plt = plotting.pyplot()

STARTING = 3  # s, until the speed is steady


def line_sizes(load, value, orders):
    window = 1 - np.cos(2 * np.pi * (load - load[0]) / (load[-1] - load[0]))
    window /= window.sum()
    value = value - (window * value).sum()
    return [2 * abs((window * value * np.exp(-1j * n * load)).sum()) for n in orders]


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("record", metavar="RECORD.csv")
    parser.add_argument("--teeth", type=int, required=True, help="of the gear at the load")
    parser.add_argument("--base-radius", type=float, required=True, help="of that gear [m]")
    parser.add_argument("--out", required=True, help="picture to write: .png, .svg or .pdf")
    arguments = parser.parse_args()
    data = np.genfromtxt(arguments.record, delimiter=",", names=True)
    steady = data["time"] > STARTING
    load = data["load_position"][steady]
    value = 1e6 * arguments.base_radius * (data["motor_position"][steady] - load)
    figure, axes = plt.subplots(3, 1, figsize=(9, 9), constrained_layout=True)
    figure.suptitle("Motor minus load along the line of action")
    tooth = arguments.teeth * load / (2 * np.pi)
    few = (tooth > tooth[0] + 1) & (tooth < tooth[0] + 5)
    axes[0].plot(tooth[few], value[few], ".", ms=2)
    axes[0].set_xlabel("teeth of the gear")
    axes[1].plot(load / (2 * np.pi), value, lw=0.5)
    axes[1].set_xlabel("turns of the load")
    for axis in axes[:2]:
        axis.set_ylabel("motor minus load [um]")
    orders = np.concatenate([np.arange(5, 40, 0.1), np.arange(40, 2.2 * arguments.teeth, 0.25)])
    axes[2].semilogy(orders, line_sizes(load, value, orders), lw=0.8)
    axes[2].set_xlabel("order [per turn of the load]")
    axes[2].set_ylabel("amplitude [um]")
    plotting.save(figure, arguments.out)


if __name__ == "__main__":
    plotting.run(main)
