#!/bin/bash
# Installs, builds, and goes with one simulated joint through five acts: it is recorded when new, commissioned, gets its
# monitoring curve, wears while the diagnoser watches it, and a servo has an effect that its model lacks.
# Usage: bash scripts/demo.sh     the records, reports and the picture are in the workspace's folder demo
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if (($#)); then
  sed -n '2,4s/^# //p' "$0"
  [[ $1 == -h || $1 == --help ]] && exit 0
  exit 64
fi
new=2.0e-5                      # m, backlash of the new joint
worn=(6.0e-5 9.0e-5 1.3e-4)     # m, as it wears
sampling_rate=2500              # Hz

install_dependencies build
mkdir -p "${WS}/log"
install_dependencies run >"${WS}/log/install_run.log" 2>&1 & # beside the compiler
installed=$!
echo "Building in ${WS} (minutes the first time, seconds later)"
programs=(simulator diagnoser simulate identify build_curve diagnose_record trace_residual)
build "${PACKAGE}_generate_messages_py" "${programs[@]/#/${PACKAGE}_}" || exit 1
wait "${installed}" || { cat "${WS}/log/install_run.log" >&2 && exit 1; }
use_workspace

out=${WS}/demo
log=${WS}/log/demo.log
rm -rf "${out}"
mkdir -p "${out}" "${WS}/log"
cd "${out}"
: >"${log}"
# quiet COMMAND...: what it prints is shown only if it fails; exit codes up to 3 are answers.
quiet() {
  local status=0
  "$@" >>"${log}" 2>&1 </dev/null || status=$?
  ((status <= 3)) || { tail -n 20 "${log}" >&2 && fail "failed with exit code ${status}: $* (all of it in ${log})"; }
}
say() { /usr/bin/python3 "${REPO}/scripts/demo_report.py" "$@"; }

# A roscore of its own on a free port, reachable from this machine only. Whatever is left of it ends with the script.
port=$(free_port)
export ROS_MASTER_URI=http://localhost:${port}
launched=
finish() {
  [[ -z ${launched} ]] || kill -INT "${launched}" 2>/dev/null || true
  [[ -z ${launched} ]] || wait "${launched}" 2>/dev/null || true
  launched=
}
trap finish EXIT
trap 'exit 130' INT TERM
# start SERVICE ARGUMENT...: roslaunch demo.launch, until the service is there.
start() {
  roslaunch --port "${port}" "${PACKAGE}" demo.launch machine:="${out}/machine.yaml" sampling_rate:="${sampling_rate}" \
    "${@:2}" >>"${log}" 2>&1 &
  launched=$!
  for ((i = 0; i < 300; ++i)); do
    rosservice type "$1" >/dev/null 2>&1 && return 0
    kill -0 "${launched}" 2>/dev/null || break
    sleep 0.1
  done
  tail -n 20 "${log}" >&2
  fail "the nodes did not start"
}
# record FILE: three seconds of the running joint, all of them: a busy computer loses messages, then it is tried again.
record() {
  for ((i = 0; i < 5; ++i)); do
    quiet rosbag record --quiet --buffsize=0 --duration=3 --output-name="$1" /joint_states
    say lost "$1" "${sampling_rate}" && return 0
  done
  echo "   This computer is too busy to record all of them; what is lost is lost."
}

# The machine is not quite that of its rig file, as no machine is.
declared=${REPO}/config/sarkar_1997.yaml
sed -e 's/inertia: 2.24e-5 /inertia: 2.00e-5 /; s/viscous_damping: 0.0048 /viscous_damping: 0.0046 /' \
  -e 's/stiffness: 28.71 /stiffness: 30.0 /; s/alpha: 0.72 /alpha: 0.90 /' \
  -e 's/^  seed: 1 .*/  seed: 7\n  sensor_torque: {noise: 0.002}\n  motor_position: {resolution: 2.0e-5}/' \
  "${declared}" >machine.yaml

echo
echo "1  A joint is new. It is simulated, and recorded with rosbag."
start /simulator/set_backlash backlash:="${new}" diagnose:=false
record new.bag
finish

echo
echo "2  identify commissions it: the values of its rig file become those of this machine."
quiet rosrun "${PACKAGE}" identify new.bag --rig "${declared}" --out fitted.yaml --json fit.json
say commissioned fit.json "${declared}" machine.yaml "${new}"

echo
echo "3  build_curve simulates that machine with more and more backlash: skewness of the torque's amplitude distribution."
quiet rosrun "${PACKAGE}" build_curve fitted.yaml --sample-rate "${sampling_rate}" --points 27 --max-backlash 1.56e-4 --out curve.yaml
say curve curve.yaml

echo
echo "4  It wears while it runs. rosservice call /diagnoser/diagnose answers by the curve, and by witnesses without it [um]:"
start /diagnoser/diagnose backlash:="${new}" rig:="${out}/fitted.yaml" curve:="${out}/curve.yaml"
answers=()
for backlash in "${new}" "${worn[@]}"; do
  quiet rosservice call /simulator/set_backlash "{backlash: ${backlash}}"
  since=${SECONDS}
  sleep 4 # so that its last 20 periods are of this backlash
  for ((i = 0; i < 20; ++i)); do # the fit of the whole motion is made in the background
    rosservice call /diagnoser/diagnose "{joint: '', periods: 20, timeout: 30.0}" >"answer_${backlash}.yaml" ||
      fail "the service did not answer"
    say fitted "answer_${backlash}.yaml" "$((SECONDS - since))" && break
  done
  answers+=("answer_${backlash}.yaml" "${backlash}")
  say answer "${answers[@]: -2}"
done
record worn.bag
finish
quiet rosrun "${PACKAGE}" diagnose_record worn.bag --rig fitted.yaml --curve curve.yaml --json diagnosis.json --report diagnosis.html
say offline diagnosis.json

echo
echo "5  A servo's motor cogs, and its rig file does not say so. trace_residual fits one record and predicts another."
servo=${REPO}/config/two_inertia_servo.yaml
{ cat "${servo}" && echo 'terms: [{id: cogging, amplitude: 15, order: 36, phase: 0.7}]'; } >servo.yaml
sed 's/amplitude: 400 /amplitude: 300 /; s/frequency: 1 /frequency: 0.8 /' servo.yaml >servo_other_motion.yaml
quiet rosrun "${PACKAGE}" simulate servo.yaml --duration 8 --out train.csv
quiet rosrun "${PACKAGE}" simulate servo_other_motion.yaml --duration 8 --seed 2 --out test.csv
quiet rosrun "${PACKAGE}" trace_residual --rig "${servo}" --train train.csv --test test.csv --out trace
say traced trace/report.json

say picture demo.png "${declared}" machine.yaml "${answers[@]}"
echo
echo "Picture: ${out}/demo.png"
echo "Reports: ${out}/diagnosis.html, ${out}/trace/report.html"
