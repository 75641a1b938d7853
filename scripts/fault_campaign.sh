#!/bin/bash
# Tries faults and bad input on the real commands and nodes and prints a table of what came of them; exit code 1 if
# anything was bad. Usage: bash scripts/fault_campaign.sh [--seed N] [--count N] [files|messages|processes|all]
# (--help shows the further options)
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

if [[ ${1:-} == -h || ${1:-} == --help ]]; then
  exec /usr/bin/python3 "${REPO}/test/faults/campaign.py" --help
fi
install_dependencies run
build
use_workspace
exec env PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 "${REPO}/test/faults/campaign.py" "$@"
