#!/bin/bash
# Builds the package if need be, makes the test machines, runs trace_residual on each and prints the confusion table
# against the goals. Everything is kept in OUT (default: build/machines of this repository), and what is there already
# is not run again. Usage: bash scripts/trace_machines.sh [OUT [OPTION...]]; options as test/campaigns/confusion_table.py.
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
out=${1:-${REPO}/build/machines}
shift $(($# > 0))

install_dependencies run
echo "Building in ${WS}"
build
build "${PACKAGE}_test_machine" "${PACKAGE}_test_robot_joint"
executables=${WS}/devel/lib/${PACKAGE}
python3 "${REPO}/test/campaigns/confusion_table.py" --trace "${executables}/trace_residual" \
  --make "${executables}/make_machine" --keep "${out}" "$@"
