#!/bin/bash
# Installs what the package needs from Debian 12 and is not there yet; without anything missing it only looks. Debian
# packages ROS 1 itself, so no foreign archive is needed. Run as root or with sudo.
# Usage: bash scripts/install_dependencies.sh [build|run|test] [PACKAGE...]
#   build compiles the package; run: also runs all of it, and the demo; test (default): also what the tests call
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail

# One line per purpose.
build=(
  build-essential ccache cmake ninja-build                        # compiler and build
  catkin ros-core-dev                                             # ROS 1: build system, roscpp, rosbag, messages
  python3-numpy                                                   # the generators of messages import it where it is
  libactionlib-dev libdiagnostic-updater-dev                      # ROS 1 libraries outside the core
  libdynamic-reconfigure-config-init-mutex-dev python3-dynamic-reconfigure
  libboost-dev libboost-program-options-dev libeigen3-dev libfmt-dev libyaml-cpp-dev nlohmann-json3-dev
  liblz4-dev libsqlite3-dev libzstd-dev                           # recordings of ROS 2
  libminizip-dev                                                  # archives of NumPy; no rosdep key either
  libceres-dev libsundials-dev                                    # SUNDIALS has no rosdep key, hence not in package.xml
  liburdfdom-dev liburdfdom-headers-dev libexpat1-dev             # robots as URDF, and what is written into one
)
run=(
  rosbash python3-rosnode                                         # rosrun, rosnode
  python3-actionlib python3-actionlib-msgs python3-diagnostic-msgs python3-sensor-msgs python3-std-srvs
  libdiagnostic-aggregator-dev libdiagnostic-aggregator-tools     # its node, for monitoring.launch; the plugins are in -dev
  ros-robot-state-publisher                                       # arm.launch
  python3-matplotlib python3-yaml                                 # plots
  python3-aiohttp python3-rospy                                   # dashboard
  python3-cryptography python3-distributed                        # fleet_report: Dask, with TLS between its processes
)
tests=(
  catkin-lint libgtest-dev librostest-dev python3-rostest
  python3-tf2-msgs                                                # what arm.launch publishes
  chromium chromium-driver python3-selenium                       # tests that look at the pages in a browser
  liborocos-kdl-dev                                               # oracle of the arm's dynamics
  libmujoco-dev                                                   # runs what export_model writes
  clang-format clang-tidy doxygen                                 # what scripts/check_style.sh and api_doc.sh call
  debootstrap                                                     # roots with nothing, for scripts/check_fresh.sh
)
case ${1:-} in
  build) packages=("${build[@]}" "${@:2}") ;;
  run) packages=("${build[@]}" "${run[@]}" "${@:2}") ;;
  test) packages=("${build[@]}" "${run[@]}" "${tests[@]}" "${@:2}") ;;
  -h | --help)
    sed -n '2,5s/^# //p' "$0"
    exit 0
    ;;
  *) packages=("${build[@]}" "${run[@]}" "${tests[@]}" "$@") ;;
esac

missing=()
installed=" $(dpkg-query --show --showformat '${Package}=${db:Status-Status} ' "${packages[@]}" 2>/dev/null || true)"
for package in "${packages[@]}"; do
  [[ ${installed} == *" ${package}=installed "* ]] || missing+=("${package}")
done
((${#missing[@]})) || exit 0

as_root=()
if ((EUID != 0)); then
  if ! command -v sudo >/dev/null; then
    echo "install_dependencies: these packages are missing: ${missing[*]}" >&2
    echo "install_dependencies: run this script as root, or install sudo" >&2
    exit 1
  fi
  as_root=(sudo)
fi

echo "Installing ${#missing[@]} Debian packages and what they need: ${missing[*]}"
log=$(mktemp)
trap 'rm -f "${log}"' EXIT
apt() {
  if ! "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y "$@" </dev/null >"${log}" 2>&1; then
    tail -n 40 "${log}" >&2
    echo "install_dependencies: apt-get $1 failed (see above); needed are: ${missing[*]}" >&2
    exit 1
  fi
}
apt update
apt install --no-install-recommends "${missing[@]}"
