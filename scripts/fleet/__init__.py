# SPDX-License-Identifier: BSD-3-Clause
"""The parts of the command fleet_report, one idea per file."""
