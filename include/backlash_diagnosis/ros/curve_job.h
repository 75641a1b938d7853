// SPDX-License-Identifier: BSD-3-Clause
// A monitoring curve, built by the command build_curve as a job beside the node.
#pragma once

#include "backlash_diagnosis/studies/curve_builder.h"

namespace backlash::ros_bridge {

/// The same curve as that of build_curve(). `memory` [GB]: limit of the process. Throws InvalidParameter,
/// JobFailed, Cancelled.
diagnosis::MonitoringCurve build_curve_as_job(const rig_file::RigFile& rig,
                                              const studies::CurveRequest& request, double memory,
                                              const Progress& progress);

}  // namespace backlash::ros_bridge
