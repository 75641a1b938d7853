#!/bin/bash
# Builds the package if need be and counts how often the 95 % intervals of identify and trace_residual hold, on simulated
# machines whose truth is known (doc/evidence/identify.md). Usage: bash scripts/coverage.sh [OUT] (default: build/coverage;
# an hour)
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if [[ ${1:-} == -* ]]; then
  sed -n '2,4s/^# //p' "$0"
  exit 0
fi
out=${1:-${REPO}/build/coverage}
mkdir -p "${out}"
install_dependencies run
build
build "${PACKAGE}_test_machine" "${PACKAGE}_test_coverage"
executables=${WS}/devel/lib/${PACKAGE}
servo=${REPO}/config/two_inertia_servo.yaml joint=${REPO}/config/ur10e_joint.yaml
friction=asymmetric_coulomb,asymmetric_viscous,stribeck,quadratic_drag,load_dependent_friction,position_dependent_friction
either=${friction},friction_drift,gravity,cogging,delay,presliding
teeth=transmission_error,varying_backlash,mesh_hardening,mesh_hysteresis,varying_reduction_ratio,encoder_scale,local_fault

# study NAME OPTION...
study() {
  local name=$1
  shift
  "${executables}/coverage_study" "$@" --seed 201 --json "${out}/${name}.json" | tee "${out}/${name}.txt"
}

echo "== identify, servos of another simulator"
python3 "${REPO}/test/campaigns/coverage/identify_servos.py" "${out}/servos" --make "${executables}/make_machine" \
  --identify "${executables}/identify" --rig "${servo}" | tee "${out}/identify_servos.txt"
study servo --servo "${servo}" --machines 40
study joint --joint "${joint}" --machines 200
study servo_effects --servo "${servo}" --machines 12 --effects "${either},${teeth}"
study joint_effects --joint "${joint}" --machines 20 --effects "${either}"
