#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws the bag of an exciter, of a run or of a dry run: the commanded torque and the positions that came.

usage: plot_excitation.py RUN.bag --out PICTURE
"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

plt = plotting.pyplot()


def read(path):
    """Commands as times [s] and torques [N m]; of each name in the states times [s] and positions."""
    import rosbag
    times, torques, positions = [], [], {}
    try:
        with rosbag.Bag(path) as bag:
            begin = bag.get_start_time()
            for _, message, at in bag.read_messages():
                if message._type == "std_msgs/Float64":
                    times.append(at.to_sec() - begin)
                    torques.append(message.data)
                elif message._type == "sensor_msgs/JointState":
                    for name, position in zip(message.name, message.position):
                        column = positions.setdefault(name, ([], []))
                        column[0].append(at.to_sec() - begin)
                        column[1].append(position)
    except OSError as error:
        plotting.fail(66, error)
    except rosbag.ROSBagException as error:
        plotting.fail(65, "%s: %s" % (path, error))
    if not times:
        plotting.fail(65, "%s: holds no command" % path)
    return times, torques, positions


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("bag", metavar="RUN.bag", help="bag of the node exciter")
    parser.add_argument("--out", required=True, help="picture to write: .png, .svg or .pdf")
    arguments = parser.parse_args()
    times, torques, positions = read(arguments.bag)
    figure, axes = plt.subplots(2 if positions else 1, 1, figsize=(9, 6), sharex=True, constrained_layout=True,
                                squeeze=False)
    axes[0][0].step(times, torques, where="post", lw=1)
    axes[0][0].set_ylabel("commanded torque [N m]")
    if positions:
        for name, (at, values) in positions.items():
            axes[1][0].plot(at, values, lw=1, label=name)
        axes[1][0].set_ylabel("position as published")
        axes[1][0].legend(fontsize=8)
    axes[-1][0].set_xlabel("time [s]")
    plotting.save(figure, arguments.out, 110)


if __name__ == "__main__":
    plotting.run(main)
