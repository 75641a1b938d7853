# Shell functions that the scripts share; to be sourced: source "$(dirname "$0")/common.sh"
# Afterwards: REPO (this repository) and WS (the catkin workspace that the scripts build in).
# SPDX-License-Identifier: BSD-3-Clause

REPO=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
# Hidden and below build: rosrun and roslaunch search the package's folder for executables, but not there.
WS=${BACKLASH_DIAGNOSIS_WS:-${REPO}/build/.ws}
PACKAGE=backlash_diagnosis

# Debian's python3 sees the ROS modules; another one (pyenv, conda) does not.
export PATH=/usr/bin:/bin:/usr/sbin:/sbin:${PATH}
unset PYTHONPATH PYTHONHOME
# Debian's ROS lives in /usr and needs no entry here; other workspaces of the caller must not leak in.
unset CMAKE_PREFIX_PATH ROS_PACKAGE_PATH

# ccache, where it is installed, finds again what another clone has compiled: paths count from the workspace.
export CCACHE_BASEDIR=${REPO} CCACHE_NOHASHDIR=1

# fail MESSAGE: ends the script.
fail() {
  echo "$(basename "$0"): $1" >&2
  exit 1
}

# quietly NAME COMMAND...: runs it with the output in ${WS}/log/NAME.log; shows its last lines if it fails. Exit code 77: it
# could not be tried here.
quietly() {
  local log=${WS}/log/$1.log status=0
  shift
  mkdir -p "${WS}/log"
  "$@" >"${log}" 2>&1 </dev/null || status=$?
  ((status != 0 && status != 77)) || return "${status}"
  tail -n 40 "${log}" >&2
  echo "$(basename "$0"): failed: $* (all of it in ${log})" >&2
  return 1
}

# install_dependencies [run|test] [PACKAGE...]
install_dependencies() {
  bash "${REPO}/scripts/install_dependencies.sh" "$@"
}

# Creates the workspace ${WS} with this repository as its only package. The package is a folder of links, one per
# entry of the repository, not a link to the repository: that may hold the workspace, and searches would go round.
make_workspace() {
  mkdir -p "${WS}/src" || fail "cannot create the workspace ${WS}"
  WS=$(cd "${WS}" && pwd -P)
  touch "${WS}/CATKIN_IGNORE"  # for a search that starts above the workspace
  local folder=${WS}/src/${PACKAGE} entry
  [[ ! -L ${folder} ]] || rm "${folder}"
  mkdir -p "${folder}"
  find -L "${folder}" -maxdepth 1 -type l -delete  # links to entries that are gone
  for entry in "${REPO}"/*; do
    case ${entry##*/} in build | devel | install) continue ;; esac
    [[ ${folder}/${entry##*/} -ef ${entry} ]] || ln -sfn "${entry}" "${folder}/"
  done
  # CMake refuses a build folder that was made elsewhere (a copied or moved repository) or for another build tool.
  local cache=${WS}/build/CMakeCache.txt
  if [[ -e ${cache} ]] && ! { grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=${WS}/src" "${cache}" &&
    grep -qxF CMAKE_GENERATOR:INTERNAL=Ninja "${cache}"; }; then
    rm -rf "${WS}/build" "${WS}/devel" "${WS}/install"
  fi
}

# Of what ninja prints, how far it is: one line that is written again and again on a terminal, else a line per fifth. Its count
# is of all files that the whole build compiles and links.
show_progress() {
  local line done total shown=0
  while IFS= read -r line; do
    [[ ${line} =~ ^\[([0-9]+)/([0-9]+)\] ]] || continue
    done=${BASH_REMATCH[1]} total=${BASH_REMATCH[2]}
    if [[ -t 2 ]]; then
      printf '\rbuilt %d of %d files' "${done}" "${total}" >&2
    elif ((done * 5 >= (shown + 1) * total)); then
      shown=$((done * 5 / total))
      printf 'built %d of %d files\n' "${done}" "${total}" >&2
    fi
  done
  [[ ! -t 2 ]] || printf '\r\033[K' >&2
}

# build [TARGET|VARIABLE...]: catkin_make in the workspace, with the output in a log that is shown if it fails.
build() {
  make_workspace
  mkdir -p "${WS}/log"
  local log=${WS}/log/build${1:+_${1//\//_}}.log
  (
    flock 9  # demo.sh and test.sh may run at the same time
    catkin_make --use-ninja --directory "${WS}" -DPYTHON_EXECUTABLE=/usr/bin/python3 "-j$(nproc)" "$@" 2>&1 </dev/null 9>&- |
      tee "${log}" | show_progress
    ((PIPESTATUS[0] == 0))
  ) 9>"${WS}/lock" && return 0
  grep -nE 'error|Error|undefined reference' "${log}" | head -n 20 >&2
  tail -n 20 "${log}" >&2
  echo "$(basename "$0"): the build failed, all of it in ${log}" >&2
  return 1
}

# Makes rosrun, roslaunch and rostest find the package, and keeps everything on this machine.
use_workspace() {
  local nounset=$-
  set +u  # the generated file reads unset variables
  # shellcheck disable=SC1091
  source "${WS}/devel/setup.bash"
  [[ ${nounset} != *u* ]] || set -u
  export ROS_HOSTNAME=localhost ROS_HOME=${WS}/ros_home ROS_MASTER_URI=${ROS_MASTER_URI:-http://localhost:11311}
  unset ROS_IP
}

# A port of this machine that nobody listens on.
free_port() {
  /usr/bin/python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'
}

# The tests that only scripts/nightly.sh runs, as a filter of gtest; and those with nodes, as files.
nightly_tests() {
  grep -vE '^(#|ros/)' "${REPO}/test/nightly.txt" | paste -sd:
}
nightly_rostests() {
  grep '^ros/' "${REPO}/test/nightly.txt" | sed 's,^,test/,'
}
# The targets of rostests whose files are read from standard input.
rostest_targets() {
  sed "s/^/run_tests_${PACKAGE}_rostest_/; s,/,_,g"
}
