// SPDX-License-Identifier: BSD-3-Clause
// Results of the core as messages. Core types live in namespace backlash, generated messages in
// backlash_diagnosis.
#pragma once

#include <backlash_diagnosis/AmplitudeDistribution.h>
#include <backlash_diagnosis/BacklashEstimate.h>
#include <backlash_diagnosis/Change.h>
#include <backlash_diagnosis/MonitoringCurve.h>
#include <backlash_diagnosis/Verdict.h>

#include "backlash_diagnosis/diagnosis/change_ledger.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"

namespace backlash::ros_bridge {

/// One period.
backlash_diagnosis::AmplitudeDistribution to_message(const diagnosis::PeriodResult& period,
                                                     const diagnosis::ApdSettings& settings,
                                                     double period_length);
/// All periods of an analysis together; skewness is the mean over the periods.
backlash_diagnosis::AmplitudeDistribution to_message(const diagnosis::ApdResult& apd,
                                                     const diagnosis::ApdSettings& settings);
/// `stamp` is that of the last sample of the diagnosis; an estimate of earlier samples has theirs.
backlash_diagnosis::BacklashEstimate to_message(const diagnosis::Estimate& estimate,
                                                const ros::Time& stamp = {});
/// `estimates`: those that the verdict combines, for the names of its members.
backlash_diagnosis::Verdict to_message(const diagnosis::Verdict& verdict,
                                       const std::vector<diagnosis::Estimate>& estimates);
backlash_diagnosis::MonitoringCurve to_message(const diagnosis::MonitoringCurve& curve);
backlash_diagnosis::Change to_message(const diagnosis::KnownChange& change, const std::string& joint);

/// Seconds since 1970 as a stamp; 0 for those that ROS cannot hold.
ros::Time to_stamp(double time);

}  // namespace backlash::ros_bridge
