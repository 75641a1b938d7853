#!/bin/bash
# Builds the package and its benchmarks, runs them and prints every figure as a ratio to a peer of the same run. The
# machine should have nothing else to do. Usage: bash scripts/benchmark.sh [OUT.json [OLDER.json]]
# OUT.json (default: build/benchmark.json of this repository) can be compared with a later run.
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if [[ ${1:-} == -h || ${1:-} == --help ]]; then
  sed -n '2,4s/^# //p' "$0"
  exit 0
fi
if [[ ${1:-} == -* ]] || (($# > 2)); then
  sed -n '3s/^# //p' "$0" >&2
  exit 64
fi
out=$(realpath -m "${1:-${REPO}/build/benchmark.json}")
older=${2:+$(realpath "$2")}

install_dependencies run libbenchmark-dev python3-scipy
echo "Building in ${WS}"
build
build "${PACKAGE}_test_machine"
use_workspace
folder=${WS}/build/benchmark
quietly configure_benchmark cmake -S "${REPO}/benchmark" -B "${folder}"
quietly build_benchmark cmake --build "${folder}" -j "$(nproc)"

mkdir -p "$(dirname "${out}")"
parts=()
for name in integration statistics curve bags; do
  echo "Running ${name}"
  "${folder}/${name}" --benchmark_out="${folder}/${name}.json" --benchmark_out_format=json >"${folder}/${name}.log" 2>&1
  parts+=("${folder}/${name}.json")
done
executables=${WS}/devel/lib/${PACKAGE}
measure() {
  echo "Running $1"
  /usr/bin/python3 "${REPO}/benchmark/$1.py" "${@:2}" >"${folder}/$1.json" 2>"${folder}/$1.log" ||
    fail "$1.py failed: ${folder}/$1.log"
  parts+=("${folder}/$1.json")
}
measure scipy_lsoda
measure nodes "${executables}" "${folder}"
measure records "${executables}"
measure fleet "${executables}"
/usr/bin/python3 "${REPO}/benchmark/summarise.py" --out "${out}" ${older:+--older "${older}"} "${parts[@]}"
