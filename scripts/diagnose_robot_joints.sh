#!/bin/bash
# Builds the package if need be, makes joints of a robot's size, runs diagnose_record on both motions of each, with the load's
# encoder and with the motor's alone, and counts answers and misses. Everything is kept in OUT (default: build/robot_joints of this
# repository). Usage: bash scripts/diagnose_robot_joints.sh [OUT [OPTION...]]; options as test/campaigns/robot_joints_table.py.
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
out=${1:-${REPO}/build/robot_joints}
shift $(($# > 0))

install_dependencies run
echo "Building in ${WS}"
build
build "${PACKAGE}_test_robot_joint"
executables=${WS}/devel/lib/${PACKAGE}
python3 "${REPO}/test/campaigns/robot_joints_table.py" --diagnose "${executables}/diagnose_record" \
  --make "${executables}/make_robot_joint" --keep "${out}" "$@"
