#!/bin/bash
# The open question of Yumrukcal (2013, Section 6.2.1): why does the position difference drift under load? Simulates the
# servo with each candidate cause, and asks trace_residual, which knows none of them, what its model lacks. Minutes; all
# is kept in OUT (default: build/position_drift of this repository). Usage: bash scripts/trace_position_drift.sh [OUT]
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if (($# > 1)) || [[ ${1:-} == -h || ${1:-} == --help ]]; then
  sed -n '2,4s/^# //p' "$0"
  [[ ${1:-} == -h || ${1:-} == --help ]] && exit 0
  exit 64
fi
out=${1:-${REPO}/build/position_drift}
mkdir -p "${out}" || fail "cannot create ${out}"
out=$(cd "${out}" && pwd -P)

install_dependencies run
echo "Building in ${WS}"
build
bin=${WS}/devel/lib/${PACKAGE}
declared=${REPO}/config/yumrukcal_2013.yaml

# Two runs over the same half turn: the gap, the teeth and both directions of the force everywhere on the way.
cat >"${out}/yumrukcal_2013_runs.yaml" <<'RUNS'
schema_version: 1
test_runs:
  train:
    duration: 30                  # s
    excitation: {type: square, amplitude: 200, frequency: 1, bias: 20}    # N m, Hz, N m
  test:
    duration: 30
    excitation: {type: square, amplitude: 180, frequency: 0.8, bias: 20}
RUNS

# ask NAME TERMS: TERMS in the notation of a rig file's list, or "" for the declared machine.
ask() {
  local folder=${out}/$1 machine
  mkdir -p "${folder}"
  cp "${out}/yumrukcal_2013_runs.yaml" "${folder}/"
  machine=${folder}/machine.yaml
  cp "${declared}" "${machine}"
  [[ -z $2 ]] || printf 'terms: [%s]\n' "$2" >>"${machine}"
  "${bin}/simulate" "${machine}" --run train --seed 1 --out "${folder}/train.csv" >/dev/null
  "${bin}/simulate" "${machine}" --run test --seed 2 --out "${folder}/test.csv" >/dev/null
  "${bin}/trace_residual" --rig "${declared}" --train "${folder}/train.csv" --test "${folder}/test.csv" \
    --out "${folder}/report" >"${folder}/answer.txt" || [[ $? == 3 ]]
  printf '\n%s: %s\n' "$1" "${2:-the declared machine}"
  sed -n '1p; /^effects that/,/^$/p; /^unexplained/,/^$/p; /^machine (load/,$ { /backlash_angle\|load_coulomb \|mesh_stiffness\|warning\|note/p }' \
    "${folder}/answer.txt"
}

wheel="base_radius: 0.45, pressure_angle: 0.349"  # of the ring gear, m and rad
ask declared ""
ask scale_error "{id: encoder_scale, scale: 1.0e-3}"
ask opening_centre "{id: radial_compliance, compliance: 5.8e-7, ${wheel}}"
ask varying_ratio "{id: varying_reduction_ratio, change: 1.0e-7}"
ask eccentric_ring "{id: eccentricity, eccentricity: 5.0e-5, ${wheel}, order: 1, phase: 0.5}"
ask eccentric_pinion "{id: eccentricity, eccentricity: 2.0e-5, ${wheel}, order: 19, phase: 0.5}"
ask eccentric_encoder "{id: transmission_error, amplitude: 3.0e-5, order: 1, phase: 0.5}"
ask friction_wind_up "{id: presliding, body: load, distance: 2.0e-3, damping: 0}"
ask more_friction "{id: load_dependent_friction, body: load, coefficient: 0.05}"
