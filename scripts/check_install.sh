#!/bin/bash
# Installs the package into WS/install and tries it from there alone: nothing is missing, commands, nodes, scripts and
# launch files run, and a package that uses it (test/downstream) builds and runs. Usage: bash scripts/check_install.sh
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if (($#)); then
  sed -n '2,3s/^# //p' "$0"
  [[ $1 == -h || $1 == --help ]] && exit 0
  exit 64
fi

make_workspace
installed=${WS}/install
work=${WS}/check_install
rm -rf "${installed}" "${work}"
mkdir -p "${work}"
build install || fail "the installation failed"

unset LD_LIBRARY_PATH  # of the caller, who may use the workspace
set +u  # the generated file reads unset variables
# shellcheck disable=SC1091
source "${installed}/setup.bash"
set -u
export ROS_HOME=${work}/ros_home ROS_MASTER_URI=http://localhost:11311 ROS_HOSTNAME=localhost
cd "${work}"
share=${installed}/share/${PACKAGE}
bin=${installed}/lib/${PACKAGE}
[[ $(rospack find "${PACKAGE}") == "${share}" ]] || fail "rospack does not find the installation"

# complete WHAT EXPECTED FOUND: two lists of names, of which the second lacks none of the first.
complete() {
  local missing
  missing=$(comm -23 <(sort <<<"$2") <(sort <<<"$3"))
  [[ -z ${missing} ]] || fail "$1: not installed: ${missing//$'\n'/ }"
}
names() { find "$1" -mindepth 1 -maxdepth 1 "${@:2}" -printf '%f\n'; }
for folder in config launch msg srv action; do
  complete "${folder}" "$(names "${REPO}/${folder}")" "$(names "${share}/${folder}")"
done
headers() { (cd "$1" && find . -name '*.h'); }
complete headers "$(headers "${REPO}/include/${PACKAGE}")" "$(headers "${installed}/include/${PACKAGE}")"
programs=$(names "${REPO}/src/nodes" -name '*.cpp'; names "${REPO}/src/tools" -name '*.cpp')
programs=${programs//.cpp/}
plots=$(names "${REPO}/scripts" -name 'plot_*.py')
complete programs "${programs}"$'\n'"${plots}" "$(names "${bin}" -executable)"
! grep -rE '#include <(yaml-cpp|sundials|cvode|arkode|nvector)' "${installed}/include" >&2 ||
  fail "a header needs what only the library should"

for name in ${programs} ${plots}; do
  quietly help rosrun "${PACKAGE}" "${name}" --help || fail "${name} --help"
done
for launch in "${share}"/launch/*.launch; do
  # Anything will do for an argument that has no default: nothing starts.
  mapfile -t required < <(sed -nE '/default=|value=/!s/.*<arg name="([a-z_]+)".*/\1:=given/p' "${launch}")
  quietly launch roslaunch --nodes "${PACKAGE}" "${launch##*/}" "${required[@]}" || fail "${launch}"
done
python3 -c "
from backlash_diagnosis.msg import BacklashEstimate, BuildCurveAction
from backlash_diagnosis.srv import Diagnose" || fail "the messages cannot be imported in Python"

rig=${share}/config/sarkar_1997.yaml
quietly simulate rosrun "${PACKAGE}" simulate "${rig}" --duration 2 --out run.bag || fail "simulate"
grade=0
rosrun "${PACKAGE}" diagnose_record run.bag --rig "${rig}" --method lost_motion --json report.json >diagnosis.txt || grade=$?
((grade <= 2)) || fail "diagnose_record"
grep -q '"status": *"ok"' report.json || fail "diagnose_record does not find the backlash"
# What knows arms is loaded from beside the other libraries.
quietly arm rosrun "${PACKAGE}" simulate "${share}/config/two_link_arm/two_link_arm.yaml" --duration 0.2 --out arm.csv || fail "simulate of an arm"
quietly convert rosrun "${PACKAGE}" convert_record run.bag run.csv || fail "convert_record"
quietly plot rosrun "${PACKAGE}" plot_record.py run.csv --out run.png || fail "plot_record.py"
[[ -s run.png ]] || fail "plot_record.py drew nothing"

quietly downstream_cmake cmake -S "${REPO}/test/downstream" -B downstream -DPYTHON_EXECUTABLE=/usr/bin/python3 \
  -DCMAKE_DISABLE_FIND_PACKAGE_SUNDIALS=ON -DCMAKE_DISABLE_FIND_PACKAGE_yaml-cpp=ON ||
  fail "a package that uses this one cannot be configured"
quietly downstream_make cmake --build downstream || fail "a package that uses this one does not build"
quietly downstream_run downstream/devel/lib/backlash_downstream/backlash_downstream "${rig}" ||
  fail "a package that uses this one does not find the backlash"
echo "${installed}: complete, and a package that uses it builds and runs"
