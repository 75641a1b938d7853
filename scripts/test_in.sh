#!/bin/bash
# Runs the tests of the last commit on another Debian, in a root of its own: makes the root with debootstrap (once), clones
# the repository into it, installs the dependencies there and runs the tests. Ends with that run's last line and exit code.
# Usage: bash scripts/test_in.sh [--roots FOLDER] [--fresh] bookworm|trixie|bullseye [COMMAND ARGUMENT...]
#   --roots FOLDER  where the roots are kept, some 6 GB each (default: $BACKLASH_DIAGNOSIS_ROOTS, else build/roots)
#   --fresh         in a new root, in memory and gone at the end, with nothing installed; uses this machine's ccache
#   COMMAND         runs in place of: bash scripts/test.sh
# Exit code 77 where no root can be made.
# As root, with the right to mount. Measured records of ../shared are seen in the root, read only, where they are there.
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

usage() { sed -n '2,9s/^# //p' "$0"; }
cannot() { echo "$(basename "$0"): $1" >&2 && exit 77; }

roots=${BACKLASH_DIAGNOSIS_ROOTS:-${REPO}/build/roots}
fresh=()
while (($#)); do
  case $1 in
    --roots) roots=${2:?--roots needs a folder} && shift 2 ;;
    --fresh) fresh=(--fresh) && shift ;;
    -h | --help) usage && exit 0 ;;
    *) break ;;
  esac
done
case ${1:-} in
  bookworm | trixie | bullseye) suite=$1 && shift ;;
  *) usage && exit 64 ;;
esac
command=("$@")
((${#command[@]})) || command=(bash scripts/test.sh)
home=/srv/backlash_diagnosis  # of the clone in the root
cache_inside=/srv/ccache       # of the compiler, there

# All that this script mounts, and all that the tests start, lives in namespaces that end with the script, however it
# ends: nothing is left to unmount, and who deletes the root later does not reach through a mount.
if [[ ${BACKLASH_DIAGNOSIS_IN_NAMESPACE:-} != "$$" ]]; then
  ((EUID == 0)) || cannot "run as root: it makes a root file system and changes into it"
  unshare --mount --pid --fork true 2>/dev/null ||
    cannot "no mounts are allowed here (a container without CAP_SYS_ADMIN?): the tests need /proc, /dev and a clean end"
  mkdir -p "${roots}"
  roots=$(cd "${roots}" && pwd -P)
  touch "${roots}/CATKIN_IGNORE"  # the roots hold packages of their own
  # shellcheck disable=SC2016
  exec unshare --mount --propagation private --pid --fork --kill-child \
    env BACKLASH_DIAGNOSIS_IN_NAMESPACE=1 bash "$0" --roots "${roots}" "${fresh[@]}" "${suite}" "${command[@]}"
fi
trap 'exit 130' INT  # the first process of a namespace hears only what it asks for; with it all others end
trap 'exit 143' TERM
root=${roots}/${suite}
if ((${#fresh[@]})); then
  mkdir -p "${roots}/fresh"
  mount -t tmpfs -o size=12G tmpfs "${roots}/fresh" || cannot "cannot mount a file system in memory"
  root=${roots}/fresh/${suite}
else
  exec 9>"${roots}/${suite}.lock"
  flock --nonblock 9 || fail "another run uses ${root}"
fi

# The Debian mirrors of this machine, for the other suite: "URI SUITE COMPONENT" a line.
mirrors() {
  local here found
  here=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
  found=$(apt-get indextargets --format '$(REPO_URI) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' 'Origin: Debian' |
    awk -v here="${here}" -v suite="${suite}" '$2 == here || $2 ~ "^" here "-(updates|security)$" { sub(here, suite, $2); print }')
  echo "${found:-http://deb.debian.org/debian ${suite} main}"
}

make_root() {
  local mirror
  command -v debootstrap >/dev/null || install_dependencies run debootstrap
  [[ -n $(command -v debootstrap) ]] || cannot "debootstrap cannot be installed"
  mirror=$(mirrors | awk -v suite="${suite}" '$2 == suite { print $1; exit }')
  echo "Making a root of Debian ${suite} in ${root} (minutes)"
  rm -rf --one-file-system "${root}.part"
  debootstrap --variant=minbase --include=ca-certificates,git "${suite}" "${root}.part" "${mirror}" \
    >"${root}.log" 2>&1 || { tail -n 20 "${root}.log" >&2 && cannot "debootstrap failed, see above"; }
  mv "${root}.part" "${root}"
}

# What this machine knows of the network and of its mirrors (proxy, checks of dates); services stay off.
configure_root() {
  cp -L /etc/resolv.conf /etc/hosts "${root}/etc/"
  mirrors | sed 's/^/deb /' >"${root}/etc/apt/sources.list"
  apt-config dump --no-empty | grep '^Acquire::' | grep -vE '^Acquire::(IndexTargets|Changelogs|CompressionTypes)' \
    >"${root}/etc/apt/apt.conf.d/90host" || true
  printf '#!/bin/sh\nexit 101\n' >"${root}/usr/sbin/policy-rc.d"
  chmod +x "${root}/usr/sbin/policy-rc.d"
}

mount_root() {
  mount -t proc proc "${root}/proc" 2>/dev/null || mount --rbind /proc "${root}/proc" || fail "cannot mount /proc"
  mount --rbind /dev "${root}/dev" || fail "cannot mount /dev"
  mount --rbind /sys "${root}/sys" || fail "cannot mount /sys"
  mount -t tmpfs tmpfs "${root}/run" || fail "cannot mount /run"
  local shared=${REPO}/../shared
  if [[ -d ${shared} ]]; then
    mkdir -p "${root}/srv/shared"
    mount --bind "$(cd "${shared}" && pwd -P)" "${root}/srv/shared" && mount -o remount,bind,ro "${root}/srv/shared"
  fi
  local cache
  if ((${#fresh[@]})) && cache=$(ccache --get-config cache_dir 2>/dev/null) && [[ -n ${cache} ]]; then
    mkdir -p "${cache}" "${root}${cache_inside}"
    mount --bind "${cache}" "${root}${cache_inside}" || fail "cannot mount ${cache}"
  fi
}

# The clone takes the place of the last one; what was built from that stays.
clone() {
  local fresh=${root}${home}.new
  rm -rf --one-file-system "${fresh}"
  git clone --quiet "file://${REPO}" "${fresh}" || fail "cannot clone ${REPO}"
  if [[ -d ${root}${home}/build ]]; then mv "${root}${home}/build" "${fresh}/build"; fi
  rm -rf --one-file-system "${root:?}${home}"
  mv "${fresh}" "${root}${home}"
}

[[ -d ${root} ]] || make_root
configure_root
mount_root
clone
prepare=true what="nothing"
((${#fresh[@]})) || prepare="bash scripts/install_dependencies.sh test" what="the dependencies"
echo "Debian ${suite}, commit $(git -C "${root}${home}" rev-parse --short HEAD): installing ${what}, then ${command[*]}"
chroot "${root}" env -i HOME=/root "CCACHE_DIR=${cache_inside}" PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 "TERM=${TERM:-dumb}" "CI=${CI:-}" \
  bash -c "cd \"\$0\" && ${prepare} && exec \"\$@\"" "${home}" "${command[@]}"
