#!/bin/bash
# Types what a page shows as commands (its blocks of four spaces and more) into one shell, in an empty folder and with a master's
# port of its own. Answers stand in quotes or fences there, and exit codes 0 to 3 of a command are answers.
# Usage: bash scripts/check_howto.sh [PAGE]...      default: the tutorial and the how-to pages that need no robot of one's own
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

case ${1:-} in -*)
  sed -n '2,5s/^# //p' "$0"
  [[ $1 == -h || $1 == --help ]] && exit 0
  exit 64
  ;;
esac
pages=("$@")
((${#pages[@]})) || pages=("${REPO}"/doc/tutorial.md
  "${REPO}"/doc/howto/{commission_a_joint,detect_changes,diagnose_a_bag,export_a_model,make_a_curve,make_a_rig_file,plan_a_motion,trace_a_residual,use_ros2_records,watch_a_fleet,watch_a_joint,watch_a_robot}.md)
make_workspace
use_workspace
failed=0
for page in "${pages[@]}"; do
  page=$(realpath "${page}")
  work=${WS}/check_howto/$(basename "${page}" .md)
  rm -rf "${work}"
  mkdir -p "${work}/home"
  # A block within a list is indented by four more.
  awk '/^ *$/ {blank = 1; next}
       /^    / && (blank || inside) {
         if (blank || !inside) { match($0, /^ +/); indent = RLENGTH }
         inside = 1; blank = 0; print substr($0, indent + 1); next
       }
       {inside = 0; blank = 0}' "${page}" >"${work}/commands.sh"
  status=0
  (
    cd "${work}"
    unset ROS_HOME  # the reader's is ~/.ros
    export HOME=${work}/home ROS_LOG_DIR=${work}/ros_log ROS_MASTER_URI
    ROS_MASTER_URI=http://localhost:$(free_port)
    mkdir bin
    printf '#!/bin/sh\nexec %s -p %s\n' "$(command -v roscore)" "${ROS_MASTER_URI##*:}" >bin/roscore
    chmod +x bin/roscore
    PATH=${work}/bin:${PATH}
    # shellcheck disable=SC2016
    timeout -k 5 1800 bash -E -c 'stop() { kill $(jobs -p); for i in {1..100}; do [[ -n $(jobs -rp) ]] || return; sleep 0.1; done; kill -9 $(jobs -p); }
      trap '\''s=$?; ((s <= 3)) || { echo "exit code $s of: $BASH_COMMAND" >&2; stop; exit 1; }'\'' ERR
      source commands.sh </dev/null
      trap - ERR
      stop 2>/dev/null
      exit 0' >log 2>&1
  ) || status=$?
  ((status == 0)) && echo "$(basename "${page}"): works as typed" && continue
  failed=1
  tail -n 15 "${work}/log" >&2
  echo "$(basename "${page}"): does not work as typed (all of it in ${work}/log)" >&2
done
exit "${failed}"
