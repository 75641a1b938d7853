#!/bin/bash
# Pastes every command under "First questions" of the README in an empty folder, one after the other and without a wait of its
# own, on a machine without a master, and looks for the answers that the README quotes, their figures within a tenth.
# Exit codes 0 to 3 of a command are answers. Usage: bash scripts/check_readme.sh
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if (($#)); then
  sed -n '2,4s/^# //p' "$0"
  [[ $1 == -h || $1 == --help ]] && exit 0
  exit 64
fi

make_workspace
use_workspace
work=${WS}/check_readme
rm -rf "${work}"
mkdir -p "${work}/home" && cd "${work}"
export HOME=${work}/home ROS_HOME=${work}/ros_home ROS_LOG_DIR=${work}/ros_log
ROS_MASTER_URI=http://localhost:$(free_port)

# Nodes are ended one after the other, the master last: a node that has lost its master takes seconds to go.
started=()
finish() {
  local i
  for ((i = ${#started[@]} - 1; i >= 0; --i)); do
    kill -INT "${started[i]}" 2>/dev/null || true
    wait "${started[i]}" 2>/dev/null || true
  done
}
trap finish EXIT
trap 'exit 130' INT TERM
beside() {
  "$@" >"beside_${#started[@]}.log" 2>&1 </dev/null &
  started+=($!)
}

mapfile -t commands < <(awk '/^## / {inside = $0 == "## First questions"} inside && sub(/^    /, "")' "${REPO}/README.md")
((${#commands[@]} >= 12)) || fail "README.md: only ${#commands[@]} commands under 'First questions'"
for command in "${commands[@]}"; do
  echo "\$ ${command}"
  case ${command} in
    *'&')
      eval "beside ${command%&}"
      continue
      ;;
    until*)  # a wait of the README's own, which must end
      # shellcheck disable=SC2016
      timeout 120 bash -c "${command}" || fail "still not after 120 s: ${command}"
      continue
      ;;
  esac
  status=0
  eval "${command}" >answer.txt 2>&1 || status=$?
  tail -n 2 answer.txt
  cat answer.txt >>answers.txt
  ((status <= 3)) || fail "exit code ${status} of: ${command}: $(cat answer.txt)"
  [[ ${command} != rosservice* ]] || grep -qx 'success: True' answer.txt || fail "no answer: $(head -n 3 answer.txt)"
done
for made in report.html fitted.yaml fit.png report/report.html changes.json; do
  [[ -s ${made} ]] || fail "${made}: no such file after all commands"
done
python3 - "${REPO}/README.md" answers.txt <<'END' || fail "an answer is not the one that README.md quotes"
import re
import sys

NUMBER = r"\d[\d.]*(?:e-?\d+)?"

def words(text):  # YAML folds long strings
    return " ".join(re.sub(r"\\\n\s*\\?", "", text).split())

def is_given(quote, text):  # a live node answers from other samples, another processor rounds otherwise
    figures = [float(figure.rstrip(".")) for figure in re.findall(NUMBER, quote)]
    pattern = f"({NUMBER})".join(re.escape(part) for part in re.split(NUMBER, quote))
    return any(all(abs(float(given.rstrip(".")) - figure) <= 0.1 * abs(figure) for given, figure in zip(found.groups(), figures))
               for found in re.finditer(pattern, text))

page, said = (open(name).read() for name in sys.argv[1:])
quotes = re.findall(r"(?:^>.*\n)+", page, re.MULTILINE)
missing = []
for quote in quotes:
    lines = [line[1:] for line in quote.splitlines()]
    parts = lines if lines[0].startswith("     ") else [" ".join(lines)]  # a piece of a table, or a sentence
    missing += [part for part in parts if not is_given(words(part), words(said))]
print(f"{len(quotes)} quoted answers, {len(missing)} not given", *missing, sep="\n")
sys.exit(bool(missing) or len(quotes) < 5)
END
