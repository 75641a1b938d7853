#!/bin/bash
# Three simulated joints at 1 kHz and one diagnoser, for long and as fast as the machine takes: no memory growth, no
# sample lost, every estimate delivered, right answers. With `robot`, the simulated robot and its change_watch at five times real time:
# no estimate old, nothing cried of a healthy machine, late changes reported. Prints a table; exit code 1 if anything failed.
# Usage: bash scripts/soak.sh [SIMULATED_SECONDS=3600] [--factor N] [--json OUT.json]
#        bash scripts/soak.sh robot [MINUTES=30] [--json OUT.json]
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

script=soak.py
[[ ${1:-} != robot ]] || { script=robot.py && shift; }
install_dependencies run
build
use_workspace
exec env PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 "${REPO}/test/soak/${script}" "$@"
