#!/bin/bash
# Checks how the files are written: the licence in the first lines of each, the layout by .clang-format, the names by
# .clang-tidy (for which it builds the messages if need be). Usage: bash scripts/check_style.sh [licence|format|naming]...
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

format() {
  files '*.cpp' '*.h' | tr '\n' '\0' | xargs -0 -n 40 -P "$(nproc)" clang-format --dry-run -Werror
}

naming() {
  build "${PACKAGE}_generate_messages_cpp" &&
    python3 scripts/check_naming.py "${WS}/build/compile_commands.json" "${WS}/src/${PACKAGE}"
}

parts=("$@")
((${#parts[@]})) || parts=(licence format naming)
for part in "${parts[@]}"; do
  case ${part} in licence | format | naming) ;; *)
    sed -n '2,3s/^# //p' "$0"
    [[ ${part} == -h || ${part} == --help ]] && exit 0
    exit 64
    ;;
  esac
done

cd "${REPO}"
failed=0
for part in "${parts[@]}"; do
  "${part}" && echo "${part}: passed" || failed=1
done
exit "${failed}"
