// SPDX-License-Identifier: BSD-3-Clause
// Backlash from the whole APD: which member of the rig's family of distributions a record resembles most.
//
// Skewness is one number of the APD; the whole shape distinguishes more: it still changes where the curve of
// skewness is flat or rises. Needs the signal of the curve and a curve with its family; see apd_family.h for
// the distance and how the 95 % interval is calibrated.
#pragma once

#include "backlash_diagnosis/diagnosis/apd_skewness.h"

namespace backlash::diagnosis {

/// The estimate, or a status with its reason. `match` is that of the same record and curve.
Estimate estimate_apd_shape(const ApdResult& apd, const CurveMatch& match, const MonitoringCurve* curve);

}  // namespace backlash::diagnosis
