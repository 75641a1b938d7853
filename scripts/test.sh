#!/bin/bash
# Installs, builds and runs the tests that protect a change; scripts/nightly.sh has those that take hours. The last line is
# "N passed, N failed, N skipped"; exit code 0 only if nothing failed and something passed. Usage: bash scripts/test.sh
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

install_dependencies test || broken "installation of the dependencies"
echo "Building in ${WS}"
build all tests || broken "build"

use_workspace
# rostest starts a master of its own on a free port; this one is never contacted.
export ROS_MASTER_URI=http://localhost:11311
results=${WS}/build/test_results
rm -rf "${results}" "${ROS_HOME}"
mkdir -p "${results}" "${ROS_HOME}"
outside=()  # results that no file of the test runners holds

# check NAME COMMAND...: a test outside the test runners; exit code 77 says that it cannot be tried here.
check() {
  local status=0
  quietly "$@" || status=$?
  case ${status} in
    0) outside+=(--passed "$1") ;;
    77) outside+=(--skipped "$1: $(tail -n 2 "${WS}/log/$1.log" | head -n 1)") ;;
    *) outside+=(--failed "$1: see above") ;;
  esac
}
# run_tests WHAT JOBS NICENESS TARGET...: the exit code says nothing about the tests, only about the run.
run_tests() {
  echo "Running the $1; their output goes to ${WS}/log/run_$1.log"
  quietly "run_$1" nice -n "$3" ninja -C "${WS}/build" "-j$2" "${@:4}"
}
# rostests -l|-L: whose file says that they run beside others, or those that measure rates.
rostests() {
  (cd "${REPO}" && grep "$1" 'Runs beside others' test/ros/*.test | grep -vxF "$(nightly_rostests)" | rostest_targets)
}
mapfile -t beside < <(rostests -l)
mapfile -t alone < <(rostests -L)
# Those that take long are for nightly.sh; a name in its list that no test has would protect nothing.
nightly_list_is_whole() {
  local binary known
  known=$(for binary in "${WS}/devel/lib/${PACKAGE}/${PACKAGE}"_test_*; do
    "${binary}" --gtest_list_tests | sed 's/ *#.*//' | awk '/^[^ ]/ {suite = $1} /^ / {print suite $1}'
  done)
  known+=$'\n'$(cd "${REPO}/test" && ls ros/*.test)
  ! grep -v '^#' "${REPO}/test/nightly.txt" | grep -vxF "${known}" | sed 's/$/: in test\/nightly.txt, and no such test/' | grep .
}
check nightly_list nightly_list_is_whole

# Tests that measure rates mostly wait: what else there is to do gets the time that they leave.
run_tests rostests_alone 1 0 "${alone[@]}" &
rates=$!
GTEST_FILTER="-$(nightly_tests)" run_tests tests_beside_others $(($(nproc) + 1)) 19 "run_tests_${PACKAGE}_gtest" "${beside[@]}" ||
  outside+=(--failed "run_tests_beside_others: the run broke off")

echo "Checking style, documentation, installation and faults"
check catkin_lint catkin_lint --strict "${REPO}"
for part in licence format tidy headers rooms lanes pages words messages; do
  check "${part}" nice -n 19 bash "${REPO}/scripts/check_style.sh" "${part}"
done
# One seed, one of each class; the long runs are in doc/reliability.md.
check fault_campaign nice -n 19 bash "${REPO}/scripts/fault_campaign.sh" --seed 1 --count 1 all
grep '^NOT TRIED' "${WS}/log/fault_campaign.log" || true
wait "${rates}" || outside+=(--failed "run_rostests_alone: the run broke off")
check fresh_machine bash "${REPO}/scripts/check_fresh.sh"

/usr/bin/python3 "${REPO}/scripts/summarise_tests.py" "${results}" "${outside[@]}"
