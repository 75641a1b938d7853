#!/bin/bash
# Runs tests under sanitizers, in a workspace of its own beside the usual one; exit code 1 where one fails.
# Usage: bash scripts/sanitize.sh address    all gtests under AddressSanitizer and UBSan
#        bash scripts/sanitize.sh undefined  all gtests under UBSan alone, where memory is aligned as in earnest:
#                                            AddressSanitizer aligns it better than code may count on
#        bash scripts/sanitize.sh thread     node tests under ThreadSanitizer (test/sanitizers/thread.supp)
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

kind=${1:-}
case ${kind} in
  address) flags="-fsanitize=address,undefined -fno-sanitize-recover=undefined" ;;
  undefined) flags="-fsanitize=undefined -fno-sanitize-recover=undefined" ;;
  thread) flags="-fsanitize=thread" ;;
  -h | --help) sed -n '2,6s/^# //p' "$0" && exit 0 ;;
  *) sed -n '2,6s/^# //p' "$0" && exit 64 ;;
esac

install_dependencies run
WS=${WS}_${kind}
make_workspace
echo "Building in ${WS}"
# Debug information of lines only: the sanitizers name places by it, and the build stays small.
build all -DCMAKE_BUILD_TYPE=None "-DCMAKE_CXX_FLAGS=-O1 -g1 -fno-omit-frame-pointer ${flags}"
use_workspace
failed=0

run_gtests() {
  local leaks=${REPO}/test/sanitizers/leak.supp
  mkdir -p "${WS}/reports"
  local room log total=0 passed skipped
  for room in base signal record model simulation diagnosis rig_file identification changes studies report findings ros tools; do
    ninja -C "${WS}/build" "${PACKAGE}_test_${room}" >"${WS}/log/build_${room}.log" 2>&1 ||
      fail "the tests of ${room} cannot be built, see ${WS}/log/build_${room}.log"
    log=${WS}/log/${room}.log
    # Into files: commands that a test starts report too, and the test reads what they print.
    rm -f "${WS}/reports/${room}".*
    ASAN_OPTIONS="detect_stack_use_after_return=1 log_path=${WS}/reports/${room}" \
      UBSAN_OPTIONS="print_stacktrace=1 log_path=${WS}/reports/${room}" LSAN_OPTIONS="suppressions=${leaks} print_suppressions=0" \
      "${WS}/devel/lib/${PACKAGE}/${PACKAGE}_test_${room}" >"${log}" 2>&1 || failed=1
    passed=$(grep -c '^\[       OK \]' "${log}" || true)
    skipped=$(grep -c '^\[  SKIPPED \]' "${log}" || true)
    total=$((total + passed))
    echo "${room}: ${passed} passed, $(grep -c '^\[  FAILED  \].*ms)' "${log}" || true) failed, ${skipped} skipped," \
      "$(find "${WS}/reports" -name "${room}.*" | wc -l) reports"
    [[ -z $(find "${WS}/reports" -name "${room}.*") ]] || failed=1
  done
  echo "${total} passed in all"
}

# A node reports into files of its own and goes on; any report fails the run.
run_thread() {
  ninja -C "${WS}/build" >"${WS}/log/build_all.log" 2>&1 || fail "the build failed, see ${WS}/log"
  mkdir -p "${ROS_HOME}" "${WS}/reports"
  local test
  for test in diagnoser diagnoser_input simulator trace_residual; do
    rm -f "${WS}/reports/${test}".*
    local supp=${REPO}/test/sanitizers/thread.supp code=0
    TSAN_OPTIONS="suppressions=${supp} log_path=${WS}/reports/${test} exitcode=0 second_deadlock_stack=1" \
      rostest "${REPO}/test/ros/${test}.test" >"${WS}/log/thread_${test}.log" 2>&1 || code=$?
    local reports
    reports=$(cat "${WS}/reports/${test}".* 2>/dev/null | grep -c 'WARNING: ThreadSanitizer' || true)
    echo "${test}: exit code ${code}, ${reports} reports"
    ((code == 0 && reports == 0)) || failed=1
  done
}

case ${kind} in
  thread) run_thread ;;
  *) run_gtests ;;
esac
exit "${failed}"
