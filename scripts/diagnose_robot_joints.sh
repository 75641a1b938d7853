#!/bin/bash
# Builds the package if need be, makes joints of a robot's size (or, with MACHINES=torque_rig, rigs with a torque sensor), runs
# diagnose_record on all records of each, with one encoder less as well, and counts answers and misses. Everything is kept in OUT
# (default: build/robot_joints). Usage: bash scripts/diagnose_robot_joints.sh [OUT [OPTION...]]; options as test/campaigns/robot_joints_table.py.
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if [[ ${1:-} == -h || ${1:-} == --help ]]; then
  sed -n '2,4s/^# //p' "$0"
  exit 0
fi
if [[ ${1:-} == -* ]]; then
  sed -n '4s/^# //p' "$0" >&2
  exit 64
fi
machines=${MACHINES:-robot_joint}
out=${1:-${REPO}/build/${machines}s}
shift $(($# > 0))

install_dependencies run
echo "Building in ${WS}"
build
build "${PACKAGE}_test_${machines}"
executables=${WS}/devel/lib/${PACKAGE}
python3 "${REPO}/test/campaigns/robot_joints_table.py" --diagnose "${executables}/diagnose_record" \
  --make "${executables}/make_${machines}" --keep "${out}" "$@"
