#!/bin/bash
# Builds the package if need be, makes the servos of scripts/trace_machines.sh, runs diagnose_record on both motions of
# each and counts the intervals that miss the play. Everything is kept in OUT (default: build/machines of this
# repository). Usage: bash scripts/diagnose_machines.sh [OUT [OPTION...]]; options as test/campaigns/diagnosis_table.py.
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
build "${PACKAGE}_test_machine"
executables=${WS}/devel/lib/${PACKAGE}
python3 "${REPO}/test/campaigns/diagnosis_table.py" --diagnose "${executables}/diagnose_record" \
  --make "${executables}/make_machine" --keep "${out}" "$@"
