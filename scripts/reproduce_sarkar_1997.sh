#!/bin/bash
# Makes every figure and table of doc/sarkar_1997.md, in minutes: builds the package if need be and writes all to OUT
# (default: build/sarkar_1997 of this repository). Usage: bash scripts/reproduce_sarkar_1997.sh [OUT]
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if (($# > 1)) || [[ ${1:-} == -h || ${1:-} == --help ]]; then
  sed -n '2,3s/^# //p' "$0"
  [[ ${1:-} == -h || ${1:-} == --help ]] && exit 0
  exit 64
fi
out=${1:-${REPO}/build/sarkar_1997}
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

rig=config/sarkar_1997.yaml
fitted=config/sarkar_1997_fitted.yaml
run gears gear_geometry --centre-distance-change 100e-6 --table 5
run shim gear_geometry --centre-distance-change 50e-6 --json "${out}/gears.json"
run mesh_stiffness plot_mesh_stiffness.py "${out}/gears.json" --out "${out}/mesh_stiffness.png"
run integrators integrator_study "${rig}" --loop config/hysteresis_loop.yaml --json "${out}/integrators.json" \
  --plot "${out}/integrators"
run search search_parameters config/sarkar_1997_search.yaml --check "${fitted}" --json "${out}/search.json"
run figures plot_sarkar_1997.py --rig "${rig}" --out "${out}/figures"
run figures_fitted plot_sarkar_1997.py --rig "${fitted}" --out "${out}/figures_fitted"
run separability separability_map "${rig}" --json "${out}/separability.json" --plot "${out}/separability.png"
run uncertainty uncertainty_study "${rig}" --json "${out}/uncertainty.json" --plot "${out}/uncertainty.png" ||
  echo "Answers were wrong and sure, or wrong answers under wrong conditions: see the tables above." >&2
echo "All figures and tables: ${out}"
