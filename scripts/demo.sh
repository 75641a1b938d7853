#!/bin/bash
# Installs, builds, simulates a geared joint with backlash, asks the diagnoser for it, and draws the answer.
# Usage: bash scripts/demo.sh [HALF_GAP_METRES]     default 4e-5; results in the workspace's folder demo
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if [[ ${1:-} == -h || ${1:-} == --help ]] || (($# > 1)); then
  sed -n '2,3s/^# //p' "$0"
  [[ ${1:-} == -h || ${1:-} == --help ]] && exit 0
  exit 64
fi
half_gap=${1:-4.0e-5}
sampling_rate=5000  # Hz

install_dependencies run
echo "Building in ${WS} (minutes the first time, seconds later)"
demo_programs=(simulator diagnoser build_curve convert_record diagnose_record)
build "${PACKAGE}_generate_messages_py" "${demo_programs[@]/#/${PACKAGE}_}" || exit 1
use_workspace

out=${WS}/demo
mkdir -p "${out}"
rig=${REPO}/config/sarkar_1997.yaml
curve=${out}/curve.yaml
if [[ ! -e ${curve} || ${rig} -nt ${curve} || ${WS}/devel/lib/libbacklash_diagnosis_studies.so -nt ${curve} ]]; then
  echo "Building the monitoring curve: 41 backlash values x 8 runs x 10 periods"
  rosrun "${PACKAGE}" build_curve "${rig}" --sample-rate "${sampling_rate}" --out "${curve}"
fi

# A roscore of its own on a free port, reachable from this machine only.
port=$(free_port)
export ROS_MASTER_URI=http://localhost:${port}
roslaunch_pid=
finish() {
  [[ -z ${roslaunch_pid} ]] || kill -INT "${roslaunch_pid}" 2>/dev/null || true
  [[ -z ${roslaunch_pid} ]] || wait "${roslaunch_pid}" 2>/dev/null || true
}
trap finish EXIT
trap 'exit 130' INT TERM

echo "Starting roscore (port ${port}), simulator and diagnoser"
mkdir -p "${WS}/log"
# The first interrupt ends the launch and all that it started; --wait is not used: it starts the master itself.
roslaunch --port "${port}" "${PACKAGE}" demo.launch rig:="${rig}" half_gap:="${half_gap}" curve:="${curve}" \
  sampling_rate:="${sampling_rate}" >"${WS}/log/demo_launch.log" 2>&1 &
roslaunch_pid=$!

wait_for_service() {
  for ((i = 0; i < 300; ++i)); do
    rosservice type "$1" >/dev/null 2>&1 && return 0
    kill -0 "${roslaunch_pid}" 2>/dev/null || break
    sleep 0.1
  done
  tail -n 20 "${WS}/log/demo_launch.log" >&2
  fail "the nodes did not start"
}
wait_for_service /diagnoser/diagnose

echo "Asking: rosservice call /diagnoser/diagnose \"{joint: '', periods: 10, timeout: 30.0}\""
ask() {
  rosservice call /diagnoser/diagnose "{joint: '', periods: 10, timeout: 30.0}" >"${out}/answer.yaml" ||
    fail "the service did not answer"
}
ask
for ((i = 0; i < 20; ++i)); do # the estimator waveform takes some seconds
  grep -q "being fitted" "${out}/answer.yaml" || break
  sleep 1
  ask
done
true_backlash=$(timeout 10 rostopic echo -n 1 -p /true_backlash | tail -n 1 | cut -d, -f2)
rosbag record --quiet --duration=2 --output-name="${out}/record.bag" /joint_states >/dev/null 2>&1

finish
roslaunch_pid=

# The same from the recorded bag, offline, for the picture.
rosrun "${PACKAGE}" convert_record "${out}/record.bag" "${out}/record.csv" --rig "${rig}"
status=0
rosrun "${PACKAGE}" diagnose_record "${out}/record.bag" --rig "${rig}" --curve "${curve}" --json "${out}/diagnosis.json" \
  --report "${out}/diagnosis.html" >"${out}/diagnosis.txt" || status=$?
((status <= 3)) || fail "diagnose_record failed with exit code ${status}"
rosrun "${PACKAGE}" plot_diagnosis.py --record "${out}/record.csv" --diagnosis "${out}/diagnosis.json" \
  --curve "${curve}" --out "${out}/demo.png" --true "${true_backlash}"

/usr/bin/python3 "${REPO}/scripts/print_answer.py" "${out}/answer.yaml" "${true_backlash}"
echo "Picture: ${out}/demo.png"
echo "Report: ${out}/diagnosis.html"
