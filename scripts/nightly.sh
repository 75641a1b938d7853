#!/bin/bash
# What protects a release and takes too long for every commit (hours): the tests that draw many machines, campaigns, long
# fault runs, fuzzers, sanitizers, the install space and the README's commands, other Debians. Writes one page with dates and figures and ends with
# exit code 1 if anything failed; a part that cannot be tried here is named with its reason.
# Usage: bash scripts/nightly.sh [--page PAGE.md] [PART...]    default: all parts, build/.ws/nightly.md; --list names them
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

scripts=${REPO}/scripts
# NAME COMMAND
parts=(
  "tests run_nightly_tests"
  "readme_commands bash ${scripts}/check_readme.sh"
  "howto_commands bash ${scripts}/check_howto.sh"
  "install_space bash ${scripts}/check_install.sh"
  "api_doc bash ${scripts}/api_doc.sh ${WS}/doc"
  "faults bash ${scripts}/fault_campaign.sh --seed 1 --count 20 all"
  "two_hosts bash ${scripts}/two_hosts.sh"
  "soak bash ${scripts}/soak.sh"
  "soak_robot bash ${scripts}/soak.sh robot"
  "fuzz bash ${scripts}/fuzz.sh 120"
  "sanitize_address bash ${scripts}/sanitize.sh address"
  "sanitize_undefined bash ${scripts}/sanitize.sh undefined"
  "sanitize_thread bash ${scripts}/sanitize.sh thread"
  "debug_build check_debug_build"
  "coverage bash ${scripts}/coverage.sh"
  "trace_machines bash ${scripts}/trace_machines.sh"
  "diagnose_robot_joints bash ${scripts}/diagnose_robot_joints.sh"
  "diagnose_machines bash ${scripts}/diagnose_machines.sh"
  "trixie bash ${scripts}/test_in.sh trixie"
)

# The tests that test/nightly.txt names, and those of the campaigns' own programs.
run_nightly_tests() {
  build all tests "${PACKAGE}_nightly"
  local results=${WS}/nightly_results binary failed=0
  rm -rf "${results}" && mkdir -p "${results}"
  for binary in "${WS}/devel/lib/${PACKAGE}/${PACKAGE}"_test_* "${WS}/devel/lib/${PACKAGE}/${PACKAGE}"_nightly_*; do
    case ${binary} in
      *_nightly_*) GTEST_FILTER='*' ;;
      *) GTEST_FILTER=$(nightly_tests) ;;
    esac
    [[ $(GTEST_FILTER=${GTEST_FILTER} "${binary}" --gtest_list_tests) == *'  '* ]] || continue  # has none of them
    GTEST_FILTER=${GTEST_FILTER} "${binary}" "--gtest_output=xml:${results}/$(basename "${binary}").xml" || failed=1
  done
  use_workspace
  mapfile -t targets < <(nightly_rostests | rostest_targets)
  ninja -C "${WS}/build" -j1 "${targets[@]}" || failed=1
  /usr/bin/python3 "${REPO}/scripts/summarise_tests.py" "${results}" || failed=1
  return "${failed}"
}

# The compiler's options change no answer: without optimisation the demo's record is diagnosed as with it.
check_debug_build() (
  local release=${WS}/devel/lib/${PACKAGE} rig=${REPO}/config/sarkar_1997.yaml
  build all
  "${release}/simulate" "${rig}" --duration 2 --backlash 8e-5 --out "${WS}/debug.csv"
  "${release}/diagnose_record" "${WS}/debug.csv" --rig "${rig}" --json "${WS}/release.json" || (($? <= 3))
  WS=${WS}_debug
  build "${PACKAGE}_diagnose_record" -DCMAKE_BUILD_TYPE=Debug
  "${WS}/devel/lib/${PACKAGE}/diagnose_record" "${WS%_debug}/debug.csv" --rig "${rig}" --json "${WS}/debug.json" || (($? <= 3))
  cmp "${WS%_debug}/release.json" "${WS}/debug.json"
)

page=${WS}/nightly.md
only=()
while (($#)); do
  case $1 in
    --page) page=${2:?--page needs a file} && shift 2 ;;
    --list) printf '%s\n' "${parts[@]%% *}" && exit 0 ;;
    -h | --help) sed -n '2,5s/^# //p' "$0" && exit 0 ;;
    -*) sed -n '2,5s/^# //p' "$0" >&2 && exit 64 ;;
    *) only+=("$1") && shift ;;
  esac
done
for name in "${only[@]}"; do
  printf '%s\n' "${parts[@]%% *}" | grep -qx "${name}" || fail "${name}: no such part; --list names them"
done

install_dependencies test
make_workspace
mkdir -p "${WS}/log"
failed=0
{
  echo "| part | result | minutes | last line |"
  echo "|---|---|---|---|"
} >"${page}.part"
for part in "${parts[@]}"; do
  name=${part%% *}
  ((${#only[@]} == 0)) || printf '%s\n' "${only[@]}" | grep -qx "${name}" || continue
  echo "${name}: ${part#* }"
  begin=${SECONDS} status=0
  # shellcheck disable=SC2086
  ${part#* } >"${WS}/log/nightly_${name}.log" 2>&1 </dev/null || status=$?
  case ${status} in
    0) result=passed ;;
    77) result="not tried" ;;
    *) result=FAILED && failed=1 ;;
  esac
  echo "   ${result}"
  last=$(grep -v '^ *$' "${WS}/log/nightly_${name}.log" | tail -n 1 | cut -c1-120 | tr '|' '/')
  echo "| ${name} | ${result} | $(((SECONDS - begin + 30) / 60)) | ${last} |" >>"${page}.part"
done
{
  echo "Commit $(git -C "${REPO}" rev-parse --short HEAD), $(date -u +%Y-%m-%d), $(nproc) cores, $(. /etc/os-release && echo "${PRETTY_NAME}")."
  echo
  cat "${page}.part"
} >"${page}"
rm "${page}.part"
echo "Page: ${page}"
exit "${failed}"
