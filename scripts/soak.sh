#!/bin/bash
# Three simulated joints at 1 kHz and one diagnoser, for long and as fast as the machine takes: no memory growth, no
# sample lost, every estimate delivered, right answers. Prints a table and writes soak.json; exit code 1 if anything failed.
# Usage: bash scripts/soak.sh [SIMULATED_SECONDS=3600] [--factor N] [--json OUT.json]
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

install_dependencies run
build
use_workspace
exec env PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 "${REPO}/test/soak/soak.py" "$@"
