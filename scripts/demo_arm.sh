#!/bin/bash
# Builds, simulates a gravity-loaded arm of two geared joints with play in poses that show it and in poses that hide it, and says
# of each joint how much play it has. Usage: bash scripts/demo_arm.sh; results in the workspace's folder demo_arm
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if (($# > 0)); then
  sed -n '2,3s/^# //p' "$0"
  [[ $1 == -h || $1 == --help ]] && exit 0
  exit 64
fi

echo "Building in ${WS} (minutes the first time, seconds later)"
build "${PACKAGE}_arm_tools" "${PACKAGE}_simulate" "${PACKAGE}_diagnose_record" || exit 1
use_workspace
out=${WS}/demo_arm
mkdir -p "${out}"
files=()
for poses in two_link_arm two_link_arm_hidden; do
  rig=${REPO}/config/two_link_arm/${poses}.yaml
  rosrun "${PACKAGE}" simulate "${rig}" --duration 30 --out "${out}/${poses}.csv"
  code=0
  rosrun "${PACKAGE}" diagnose_record "${out}/${poses}.csv" --rig "${rig}" --json "${out}/${poses}.json" || code=$?
  ((code == 0 || code == 3)) || fail "diagnose_record ended with ${code}"  # 3: cannot tell, as the hidden one must
  files+=("${out}/${poses}.csv" "${out}/${poses}.json")
done
/usr/bin/python3 "${REPO}/scripts/plot_arm.py" "${files[@]}" --out "${out}/arm.png"
echo "Picture: ${out}/arm.png; the machine has 2 mrad at the shoulder and 3 mrad at the elbow"
