#!/bin/bash
# On a Debian 12 with nothing installed: the README's first command, whose answers must hold the truth, and every launch file
# that the README and doc/howto name, with no more than install_dependencies.sh run. Exit code 77 where no such root can be
# made here. Usage: bash scripts/check_fresh.sh
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

case ${1:-} in
  '') exec bash "${REPO}/scripts/test_in.sh" --fresh bookworm bash scripts/check_fresh.sh inside ;;
  inside) ;;
  *)
    sed -n '2,4s/^# //p' "$0"
    [[ $1 == -h || $1 == --help ]] && exit 0
    exit 64
    ;;
esac

begin=${SECONDS}
bash "${REPO}/scripts/demo.sh" | tee /tmp/demo.txt
echo "The demo took $((SECONDS - begin)) s, installation included"
(($(wc -l </tmp/demo.txt) <= 50)) || fail "the demo prints more than fits on a screen"
# "   60 um: ... verdict: good, 60.0 [59.4, 60.6]": at least four, each interval with the truth in it
awk '/ um: .* verdict: / {
  split($0, parts, "verdict: "); split(parts[2], v, /[][ ,]+/)
  if (v[3] > $1 || v[4] < $1) { print "the verdict misses the truth: " $0; exit 1 }
  ++answers
} END { if (answers < 4) { print "only " answers + 0 " verdicts"; exit 1 } }' /tmp/demo.txt || fail "wrong answers"
grep -q 'The model lacks cogging' /tmp/demo.txt || fail "trace_residual does not name what the model lacks"
make_workspace
[[ -s ${WS}/demo/demo.png ]] || fail "no picture"

build all || fail "the package does not build with what 'run' installs"
use_workspace
mapfile -t launches < <(cat "${REPO}/README.md" "${REPO}"/doc/howto/*.md | grep -ohE "${PACKAGE} [a-z_]+\.launch" | sort -u)
((${#launches[@]} >= 4)) || fail "README.md and doc/howto name only ${#launches[@]} launch files"
# started LOG NODES: all of them are known to the master, and nothing went wrong.
started() {
  local node
  ! grep -qE 'cannot launch|RLException|process has died|Invalid roslaunch' "$1" || return 1
  for node in $2; do rosnode list 2>/dev/null | grep -qx "${node}" || return 1; done
}
for launch in "${launches[@]}"; do
  # Arguments without a default: exciter.launch asks for the machine and its limits.
  mapfile -t given < <(sed -nE '/default=|value=/!s/.*<arg name="([a-z_]+)".*/\1/p' "${REPO}/launch/${launch##* }" |
    sed -e "s,^rig$,rig:=${REPO}/config/yumrukcal_2013.yaml," -e "s,^rig_folder$,rig_folder:=${REPO}/config/simulated_robot," -e 's/.*lower$/&:=-1/' -e '/:=/!s/$/:=1/')
  port=$(free_port)
  export ROS_MASTER_URI=http://localhost:${port}
  # shellcheck disable=SC2086
  nodes=$(roslaunch --nodes ${launch} "${given[@]}") || fail "${launch}: cannot be read"
  # shellcheck disable=SC2086
  roslaunch --port "${port}" ${launch} "${given[@]}" >/tmp/launch.log 2>&1 </dev/null &
  launched=$! good=
  for ((i = 0; i < 150; ++i)); do
    started /tmp/launch.log "${nodes}" && good=1 && break
    sleep 0.2
  done
  kill -INT "${launched}" && wait "${launched}" || true
  [[ -n ${good} ]] || { cat /tmp/launch.log >&2 && fail "${launch} does not start: ${nodes//$'\n'/ }"; }
  echo "${launch}: starts"
done
