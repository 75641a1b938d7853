#!/bin/bash
# Fuzzes what reads files and messages (test/fuzz) with libFuzzer, AddressSanitizer and UBSan; exit code 1 where one
# finds anything. Usage: bash scripts/fuzz.sh [SECONDS]   each, default 20
# The corpus grows in the build folder from run to run; an input that broke something is kept beside it.
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

seconds=${1:-20}
if [[ ! ${seconds} =~ ^[1-9][0-9]*$ ]]; then
  sed -n '2,4s/^# //p' "$0"
  [[ ${seconds} == -h || ${seconds} == --help ]] && exit 0
  exit 64
fi

install_dependencies run clang libclang-rt-14-dev
mkdir -p "${WS}"
touch "${WS}/CATKIN_IGNORE"  # for a search that starts above the workspace
WS=$(cd "${WS}" && pwd -P)
folder=${WS}/fuzz
quietly fuzz_cmake cmake -S "${REPO}/test/fuzz" -B "${folder}" -DCMAKE_CXX_COMPILER=clang++
quietly fuzz_build make -C "${folder}" "-j$(nproc)"
/usr/bin/python3 "${REPO}/test/fuzz/seeds.py" "${REPO}/config" "${folder}/seeds"

# fuzz NAME: prints one line, and all of libFuzzer's where it found something.
fuzz() {
  local corpus=${folder}/corpus/$1 log=${folder}/$1.log code=0
  mkdir -p "${corpus}"
  (cd "${folder}" && "./fuzz_$1" -max_total_time="${seconds}" -timeout=10 -rss_limit_mb=2048 -max_len=20000 -len_control=0 \
    -print_final_stats=1 -dict="${REPO}/test/fuzz/$2.dict" "${corpus}" "seeds/$1") >"${log}" 2>&1 || code=$?
  local executions edges
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "${log}")
  edges=$(grep -o 'cov: [0-9]*' "${log}" | tail -n 1 | cut -d ' ' -f 2)
  if ((code)); then
    tail -n 60 "${log}"
    echo "fuzz_$1: found something after ${executions:-?} executions; the input is in ${folder}"
    return 1
  fi
  echo "fuzz_$1: ${executions} executions, ${edges} edges covered, nothing found"
}

found=0
fuzz csv csv || found=1
fuzz table csv || found=1
fuzz rig yaml || found=1
fuzz curve yaml || found=1
fuzz joint_state names || found=1
fuzz recording recording || found=1
exit "${found}"
