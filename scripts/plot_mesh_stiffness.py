#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws the JSON of gear_geometry: pairs in contact and the stiffness laws over two mesh cycles.

usage: plot_mesh_stiffness.py GEARS.json --out PICTURE
"""
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
import plotting  # noqa: E402

plt = plotting.pyplot()

NAMES = {"step": "step (Hertz contact only)", "lin_parker": "Lin-Parker parabola, kmax of ISO 6336",
         "hertz_bending": "Hertz contact and tooth bending"}
COLOURS = {"step": "tab:red", "lin_parker": "tab:green", "hertz_bending": "tab:blue"}


def draw_pairs(axes, mesh, ratio):
    axes.step(mesh["phase"], mesh["pairs"], where="post", color="k", lw=1.2)
    axes.set_yticks(range(0, max(mesh["pairs"]) + 2))
    axes.set_ylim(0, max(mesh["pairs"]) + 0.5)
    axes.set_ylabel("pairs in contact [-]")
    axes.set_title("Pairs of teeth in contact, contact ratio %.3f" % ratio)


def draw_laws(axes, mesh, laws, relative):
    for name in laws:
        law = mesh["laws"][name]
        scale = law["mean"] if relative else 1e6
        axes.plot(mesh["phase"], [k / scale for k in law["stiffness"]], color=COLOURS[name], lw=1.3,
                  label=NAMES[name] if relative else "%s, mean %.3g N/m" % (NAMES[name], law["mean"]))
        axes.axhline(law["mean"] / scale, color="0.5" if relative else COLOURS[name], ls=":", lw=0.9)
    axes.set_ylim(0, axes.get_ylim()[1] * 1.35)  # room for the legend
    axes.legend(fontsize=8, loc="upper right")


def main():
    parser = plotting.Parser(__doc__.splitlines()[0])
    parser.add_argument("gears", metavar="GEARS.json", help="JSON of gear_geometry")
    parser.add_argument("--out", required=True, help="picture to write: .png, .svg or .pdf")
    arguments = parser.parse_args()
    gears = plotting.load_json(arguments.gears, "a pair of gears")
    mesh = gears.get("mesh_stiffness")
    if not mesh or not mesh["pairs"]:
        plotting.fail(65, "%s: holds no regular mesh cycle" % arguments.gears)
    laws = [name for name in NAMES if mesh["laws"][name]["mean"] is not None]
    figure, axes = plt.subplots(3, 1, figsize=(9, 9.5), sharex=True, constrained_layout=True,
                                gridspec_kw={"height_ratios": [1, 2, 2]})
    draw_pairs(axes[0], mesh, gears["geometry"]["contact_ratio"])
    draw_laws(axes[1], mesh, [name for name in laws if name != "step"], False)
    axes[1].set_ylabel("mesh stiffness [N/um]")
    hertz = mesh["laws"]["step"]["mean"]
    axes[1].set_title("Mesh stiffness, face width %.4g mm (step: mean %.3g N/m, beyond this axis)" %
                      (1e3 * mesh["face_width"], hertz))
    draw_laws(axes[2], mesh, laws, True)
    axes[2].set_ylabel("stiffness over its mean [-]")
    axes[2].set_title("Factor of the contact force in a simulation (stiffness_variation)")
    axes[2].set_xlabel("mesh phase [base pitches]")
    axes[2].set_xlim(0, 2)
    for a in axes:
        a.grid(True, alpha=0.3)
    figure.suptitle("%d / %d teeth, module %.5g mm, centre distance + %.4g um, backlash %.4g um" %
                    (gears["pinion_teeth"], gears["gear_teeth"], 1e3 * gears["module"],
                     1e6 * gears["geometry"]["centre_distance_change"], 1e6 * gears["geometry"]["backlash"]))
    plotting.save(figure, arguments.out, 110)


if __name__ == "__main__":
    plotting.run(main)
