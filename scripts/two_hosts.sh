#!/bin/bash
# Simulator and diagnoser on two hosts (network namespaces; needs root) over a link with delay, loss and cuts of 5 and
# 30 s: each gap must be reported and the diagnosis be right afterwards. Prints a table and writes two_hosts.json; exit
# code 1 if anything failed, 77 where it cannot be tried.
# Usage: bash scripts/two_hosts.sh [--delay S] [--jitter S] [--loss SHARE] [--cut S...]
# SPDX-License-Identifier: BSD-3-Clause
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

install_dependencies run iproute2
build
use_workspace
exec env PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 "${REPO}/test/soak/two_hosts.py" "$@"
