// SPDX-License-Identifier: BSD-3-Clause
// A monitoring curve, built by the command build_curve as a job beside the node.
#pragma once

#include "backlash_diagnosis/studies/curve_builder.h"

namespace backlash {

/// As build_curve() and the same curve; `memory` [GB] as that of a Job. Throws InvalidParameter, JobFailed,
/// Cancelled.
MonitoringCurve build_curve_as_job(const RigFile& rig, const CurveRequest& request, double memory,
                                   const Progress& progress);

}  // namespace backlash
