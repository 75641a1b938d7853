#!/bin/bash
# Checks how the files are written: the licence in the first lines of each, the layout by .clang-format, names and habits
# by .clang-tidy, that every public header compiles alone, that rooms include only what they may know and have the sizes
# that the architecture page states, that lanes do not lie where their alignment is lost and round as one alone does, that
# pages lead to each other, that no word of scripts/words.txt appears, and the form of messages.
# Usage: bash scripts/check_style.sh [licence|format|tidy|headers|rooms|lanes|pages|words|messages]... [--all|--since COMMIT]
#   tidy and headers look at the files that differ from the main branch (on it: from the commit before), --all at all.
#   format and tidy are those of clang 14 and are not tried with another; exit code 77 where that leaves nothing to do.
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

# files NAME...: those of the repository with such a name, without what builds leave there.
files() {
  local pattern=()
  for name in "$@"; do pattern+=(-o -name "${name}"); done
  find . \( -path './.git' -o -path ./build -o -path ./devel -o -path ./install -o -path ./.ws \) -prune -o \
    -type f \( "${pattern[@]:1}" \) -print
}

licence() {
  local found=0 file
  while IFS= read -r file; do
    head -n 12 "${file}" | grep -q "SPDX-License-Identifier: BSD-3-Clause" && continue
    echo "${file}: without its licence line in the first 12 lines" >&2
    found=1
  done < <(files '*.cpp' '*.h' '*.in' '*.py' '*.sh' '*.awk' CMakeLists.txt '*.cmake' Doxyfile '*.launch' '*.test' '*.msg' \
    '*.srv' '*.action' '*.cfg' '*.yaml')
  return "${found}"
}

# Another version lays out a little differently and knows other rules: the sources keep to one. 77: skipped, as elsewhere.
clang=14
of_house() {
  local version
  version=$("$1" --version | sed -nE 's/.*version ([0-9]+).*/\1/p' | head -n 1)
  [[ ${version} != "${clang}" ]] || return 0
  [[ -n ${version} ]] || { echo "$1 is not installed" >&2 && return 1; }
  echo "$1: the sources keep to version ${clang}, and here is ${version}"
  return 77
}

format() {
  of_house clang-format || return
  files '*.cpp' '*.h' | tr '\n' '\0' | xargs -0 -n 40 -P "$(nproc)" clang-format --dry-run -Werror
}

# From which commit on changes count.
changed_since() {
  [[ -z ${since} ]] || { echo "${since}" && return; }
  local base
  for base in origin/main main; do
    base=$(git merge-base HEAD "${base}" 2>/dev/null) && [[ ${base} != $(git rev-parse HEAD) ]] && echo "${base}" && return
  done
  git rev-parse -q --verify HEAD~1 || git rev-parse HEAD
}

tidy() {
  of_house clang-tidy || return
  local which=()
  ((all)) || which=(--changed-since "$(changed_since)")
  build "${PACKAGE}_generate_messages_cpp" "${PACKAGE}_gencfg" &&
    python3 scripts/check_tidy.py "${WS}/build/compile_commands.json" "${WS}/src/${PACKAGE}" "${which[@]}"
}

# The headers of ROS are left out: they need those of the messages.
headers() {
  local names
  if ((all)); then
    names=$(find include -name '*.h')
  else
    names=$(git diff --name-only --diff-filter=d "$(changed_since)" -- include; git ls-files -o --exclude-standard include)
  fi
  local name failed=0
  for name in $(grep -vE '/ros(_arm)?/' <<<"${names}"); do
    g++ -std=c++17 -fsyntax-only -Wall -Wextra -Iinclude -isystem /usr/include/eigen3 -x c++ - <<<"#include \"${name#include/}\"" ||
      failed=1
  done
  return "${failed}"
}

rooms() {
  python3 scripts/check_rooms.py CMakeLists.txt include/"${PACKAGE}" src doc/architecture.md
}

# Where containers and new put lanes they may end a program on another system and not on this one, see
# src/simulation/lanes.h; no compiler warns of it.
lanes() {
  local holders='(vector|deque|list|unique_ptr|shared_ptr|make_unique|make_shared)<(const )?[A-Za-z_:]*Lanes[0-9]*>'
  local file status=0
  ! grep -rnE "${holders}|new [A-Za-z_:]*Lanes[0-9]*\b" include src test benchmark >&2 || status=1
  # AVX-512 brings fused multiply-add, which rounds otherwise than one load alone: only some processors would show it.
  for file in $(grep -rlE 'target\("avx' src); do
    awk -v file="/${file}" 'index($0, file) { named = 1 }
                            /COMPILE_OPTIONS/ { if (named && /-ffp-contract=off/) good = 1; named = 0 }
                            END { exit !good }' CMakeLists.txt && continue
    echo "${file}: has code for AVX, and CMakeLists.txt does not compile it with -ffp-contract=off" >&2
    status=1
  done
  # Without optimisation a function that is not inlined by force passes vectors as its own instruction set does, not its caller's.
  while IFS= read -r file; do
    ! grep -HnE '^ *[A-Za-z].*[( ]const (Lanes|State|Train<Law>)[&*] [a-z_]+.*[{)]$' "${file}" | grep -vE '_LANES|;$' >&2 || status=1
  done < <(grep -rlE 'target\("avx' src)
  return "${status}"
}

pages() {
  python3 scripts/check_pages.py
}

words() {
  python3 scripts/check_words.py
}

messages() {
  python3 scripts/check_messages.py
}

parts=()
all=0
since=
while (($#)); do
  case $1 in
    licence | format | tidy | headers | rooms | lanes | pages | words | messages) parts+=("$1") ;;
    --all) all=1 ;;
    --since) since=${2:?} && shift ;;
    *)
      sed -n '2,8s/^# //p' "$0"
      [[ $1 == -h || $1 == --help ]] && exit 0
      exit 64
      ;;
  esac
  shift
done
((${#parts[@]})) || parts=(licence format tidy headers rooms lanes pages words messages)

cd "${REPO}"
failed=0
tried=0
for part in "${parts[@]}"; do
  status=0
  "${part}" || status=$?
  case ${status} in
    0) tried=1 && echo "${part}: passed" ;;
    77) echo "${part}: not tried" ;;
    *) failed=1 ;;
  esac
done
((failed == 0)) || exit 1
((tried)) || exit 77
