# SPDX-License-Identifier: BSD-3-Clause
"""The node dashboard: what it hears (joints, robot), and how it is served (server, node)."""
