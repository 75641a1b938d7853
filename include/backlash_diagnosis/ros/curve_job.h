// SPDX-License-Identifier: BSD-3-Clause
// A monitoring curve, built by the command build_curve as a job beside the node.
#pragma once

#include "backlash_diagnosis/studies/curve_builder.h"

namespace backlash::ros_bridge {

/// As build_curve() and the same curve; `memory` [GB] as that of a Job. Throws InvalidParameter, JobFailed,
/// Cancelled.
diagnosis::MonitoringCurve build_curve_as_job(const rig_file::RigFile& rig,
                                              const studies::CurveRequest& request, double memory,
                                              const Progress& progress);

}  // namespace backlash::ros_bridge
