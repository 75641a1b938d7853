#!/bin/bash
# Makes every figure and table of doc/yumrukcal_2013.md, in minutes: builds the package if need be and writes all to OUT
# (default: build/yumrukcal_2013 of this repository). Usage: bash scripts/reproduce_yumrukcal_2013.sh [OUT]
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if (($# > 1)) || [[ ${1:-} == -h || ${1:-} == --help ]]; then
  sed -n '2,3s/^# //p' "$0"
  [[ ${1:-} == -h || ${1:-} == --help ]] && exit 0
  exit 64
fi
out=${1:-${REPO}/build/yumrukcal_2013}
mkdir -p "${out}" || fail "cannot create ${out}"
out=$(cd "${out}" && pwd -P)

install_dependencies run
echo "Building in ${WS}"
build
use_workspace
cd "${REPO}"

# run NAME COMMAND...: says what it does; text output goes to OUT/NAME.txt and to the terminal.
run() {
  local name=$1
  shift
  echo "== $*"
  rosrun "${PACKAGE}" "$@" | tee "${out}/${name}.txt"
}

# wrong_rig RIG.yaml WRONG.yaml: a copy with every parameter of the gear train 20 to 30 % off, so that what is
# identified does not come from the file that made the records.
wrong_rig() {
  awk '
    /^[a-z]/ { train = /^gear_train:/ }
    train && $1 == "inertia:" { factor = (++inertias == 1 ? 1.25 : 0.8) }
    train && $1 == "stiffness:" { factor = 0.75 }
    train && $1 ~ /^(damping|backlash_angle):$/ { factor = 1.3 }
    train && $1 == "forward:" { factor = 0.75 }
    train && $1 == "backward:" { factor = 1.25 }
    factor { sub($2, $2 * factor); ++changed }
    { factor = 0; print }
    END { exit changed != 13 }
  ' "$1" >"$2" || fail "$1 has other parameters than this script knows"
}

# all_runs RIG FOLDER: every test run of the rig file, two at a time.
all_runs() {
  local rig=$1 folder=$2 simulate
  simulate=${WS}/devel/lib/${PACKAGE}/simulate
  mkdir -p "${folder}"
  echo "== simulate ${rig}, all its test runs"
  "${simulate}" "${rig}" --list-runs | tee "${folder}/runs.txt"
  sed 's/:.*//' "${folder}/runs.txt" |
    xargs -P "$(nproc)" -I NAME "${simulate}" "${rig}" --run NAME --out "${folder}/NAME.csv"
}

# circle NAME RIG START: simulates the rig's runs and identifies the machine from them, starting from START made wrong.
circle() {
  local name=$1 rig=$2 start=$3
  all_runs "${rig}" "${out}/${name}"
  wrong_rig "${start}" "${out}/${name}_wrong.yaml"
  run "${name}" identify "${out}/${name}"/*.csv --rig "${out}/${name}_wrong.yaml" --out "${out}/${name}_fitted.yaml" \
    --json "${out}/${name}.json" --plot "${out}/${name}.png"
}

rig=config/yumrukcal_2013
cp "${rig}_runs.yaml" "${out}/"  # the rig files refer to it

# Appendix A: a stop on a hinged bracket (lengths are not printed), and the resolver seen at the pinion (A.4). Fifteen
# teeth need a profile shift. The ring gear's teeth are beyond the bending polynomial of Section 2.3.
gears=(--teeth1 15 --teeth2 285 --module 3e-3 --shift1 0.3 --shift2 -0.3)
run bracket gear_geometry "${gears[@]}" --pivot-to-stop 0.2 --pivot-to-pinion 0.1 --mesh-angle-deg 60 --stop 1e-3 \
  --table 5
run resolution gear_geometry "${gears[@]}" --pinion-step-deg 9.5e-4
# Section 2.3: teeth as cylinders, as bent beams, and as Lin and Parker.
run teeth gear_geometry --teeth1 40 --teeth2 40 --module 3e-3 --face-width 1e-3 --youngs-modulus 206e9 \
  --poisson-ratio 0.3 --json "${out}/teeth.json"
run teeth_plot plot_mesh_stiffness.py "${out}/teeth.json" --out "${out}/teeth.png"

# Chapter 5, Tables 5.1 and 5.2: both configurations, and the gap map of the varying one.
circle config1 "${rig}_config1.yaml" "${rig}_config1.yaml"
circle config2 "${rig}.yaml" "${rig}.yaml"
circle varying "${rig}_varying.yaml" "${rig}.yaml"

# Runs as Chapter 3 and 6 draw them.
run external plot_record.py "${out}/config1/external_excitation.csv" --out "${out}/external.png" --from 6.2 --to 7
run square plot_record.py "${out}/config2/square_wave.csv" --out "${out}/square_wave.png" --from 10 --to 11.2

# Chapter 6: the three models against the record of a varying gap that none of them was fitted to.
run basic simulate "${rig}_basic.yaml" --run square_wave --out "${out}/basic.csv"
run basic_plot plot_record.py "${out}/basic.csv" --out "${out}/basic.png" --from 10 --to 11.2
if [[ -x ${WS}/devel/lib/${PACKAGE}/compare_models ]]; then
  record=${out}/varying/square_wave_backward.csv
  [[ -e ${record} ]] || record=${out}/varying/square_wave.csv
  run models compare_models "${record}" "${rig}_basic.yaml" "${rig}.yaml" "${rig}_varying.yaml" \
    --json "${out}/models.json" --plot "${out}/models.png"
fi
echo "All figures and tables: ${out}"
