#!/bin/bash
# Installs, builds and runs every test; the last line is "N passed, N failed, N skipped" and the exit code is 0
# only if nothing failed and something passed. Usage: bash scripts/test.sh
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if (($#)); then
  sed -n '2,3s/^# //p' "$0"
  [[ $1 == -h || $1 == --help ]] && exit 0
  exit 64
fi

broken() {  # the last line holds for whoever reads only that
  echo "FAILED $1"
  echo "0 passed, 1 failed, 0 skipped"
  exit 1
}

install_dependencies || broken "installation of the dependencies"
echo "Building in ${WS}"
build || broken "build"
build tests || broken "build of the tests"

use_workspace
# rostest starts a master of its own on a free port; this one is never contacted.
export ROS_MASTER_URI=http://localhost:11311
results=${WS}/build/test_results
rm -rf "${results}" "${ROS_HOME}"
mkdir -p "${results}" "${ROS_HOME}"
outside=()  # results that no file of the test runners holds

echo "Running the tests; their output goes to ${WS}/log/run_tests.log"
# One at a time: rostests measure rates. The exit code says nothing about the tests, only about the run.
quietly run_tests catkin_make --directory "${WS}" -DPYTHON_EXECUTABLE=/usr/bin/python3 -j1 run_tests ||
  outside+=(--failed "run_tests: the run broke off")
# check NAME COMMAND...: a test outside the test runners.
check() {
  if quietly "$@"; then outside+=(--passed "$1"); else outside+=(--failed "$1: see above"); fi
}
check catkin_lint catkin_lint --strict "${REPO}"
for part in licence format naming; do
  check "${part}" bash "${REPO}/scripts/check_style.sh" "${part}"
done
check api_doc bash "${REPO}/scripts/api_doc.sh" "${WS}/doc"
check install_space bash "${REPO}/scripts/check_install.sh"

# One seed, one of each class; the long runs are told in doc/reliability.md.
check fault_campaign bash "${REPO}/scripts/fault_campaign.sh" --seed 1 --count 1 all
check fuzz bash "${REPO}/scripts/fuzz.sh" 20
grep '^NOT TRIED' "${WS}/log/fault_campaign.log" || true

/usr/bin/python3 "${REPO}/scripts/summarise_tests.py" "${results}" "${outside[@]}"
