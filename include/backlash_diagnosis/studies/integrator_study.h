// SPDX-License-Identifier: BSD-3-Clause
// Which integrator, at which tolerance? Every method on single teeth (what goes wrong at contacts, and from
// which tolerance on it goes right) and on a whole rig (work against precision).
//
// The right motion of a tooth is that of verner at a relative tolerance of 1e-13; how far dormand_prince at
// 1e-13 is from it, and it from the closed form of the impact, is reported beside the errors.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/progress.h"
#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/studies/tooth_impact.h"
#include "backlash_diagnosis/studies/work_precision.h"

namespace backlash::studies {

struct IntegratorStudySettings {
  std::vector<Tooth> teeth;
  int starts = 0;           // runs per tooth: distance * (1 - k / (2 starts)), k = 0 ... starts - 1
  int samples = 0;          // per motion
  double half_gap = 0;      // m (angular mesh: rad), of the rig
  double rig_duration = 0;  // s
};

/// Throws MissingInput, BadData.
IntegratorStudySettings load_integrator_study(const std::string& path);

/// How wrong a motion is. NaN where it does not apply.
struct ToothErrors {
  double restitution = 0;  // -, |e / exact - 1|; without force only
  double loop_area = 0;    // -, |area / exact energy lost - 1|; without force only
  double energy = 0;       // -, |energy at the end - right one| / energy at the start
  double energy_gain = 0;  // -, what the motion at any time had beyond its energy at the start, over that
  double opposite = 0;     // m, penetration of the other flank, where the right motion never comes
  double motion = 0;       // -, largest |x - right x| / (distance + depth)
};

struct ToothRow {
  std::string tooth, method;
  AbsoluteTolerance absolute = AbsoluteTolerance::scaled;
  double tolerance = 0;       // relative
  ToothErrors worst, median;  // over the starts
  int opposite_runs = 0;      // starts that penetrated the other flank
  int failed_runs = 0;        // starts that the solver gave up; not in worst and median
  double steps = 0;           // mean over the starts

  /// The worst start errs by at most `share` of all errors, never touches the other flank, and none failed.
  bool right(double share) const;
};

struct ToothReference {
  std::string tooth;
  double impact_speed = 0;       // m/s
  double depth = 0;              // m, without damping and force
  double restitution = 0;        // exact; NaN under a force
  double agreement = 0;          // -, of the two reference methods, as ToothErrors::motion
  double restitution_error = 0;  // -, of the reference; NaN under a force
};

/// A motion to be drawn.
struct DrawnMotion {
  std::string tooth, method;
  double tolerance;  // relative, and absolute in m and m/s (AbsoluteTolerance::plain)
  ToothMotion motion;
};

struct IntegratorStudy {
  std::vector<ToothReference> references;
  std::vector<ToothRow> rows;
  std::vector<DrawnMotion> drawn;
  std::vector<WorkPrecision> work;  // the first tooth's impact; the rig
  WorkPoint rig_declared;           // the `solver` of the rig file

  /// Loosest tolerance from which on a method is right(share) at all tighter ones; NaN if it never is.
  double right_from(const std::string& tooth, const std::string& method, AbsoluteTolerance absolute,
                    double share) const;
};

/// All starts of each method at 1e-1 ... 1e-10 on one tooth. Throws InvalidParameter where the right motion
/// comes back to the other flank; Cancelled.
void study_tooth(const Tooth& tooth, const IntegratorStudySettings& settings, IntegratorStudy& study,
                 const std::function<void()>& tick = nullptr,
                 const std::vector<std::string>& methods = simulation::integrator_methods());

/// End states of the impacts from all starts.
WorkPrecision impact_work(const Tooth& tooth, int starts, const std::function<void()>& tick = nullptr);

/// Signal of the input coupling (rigid: motor position) at the rig's sampling rate, from rest in the middle
/// of the gap. The absolute tolerances keep their proportion to the relative one.
WorkPrecision rig_work(const rig_file::RigFile& file, double half_gap, double duration, WorkPoint& declared,
                       const std::function<void()>& tick = nullptr,
                       const std::vector<std::string>& methods = simulation::integrator_methods());

/// All of it. Deterministic but for the CPU times. Throws IntegrationError, InvalidParameter, Cancelled.
IntegratorStudy study_integrators(const rig_file::RigFile& file, const IntegratorStudySettings& settings,
                                  const Progress& progress = nullptr);

}  // namespace backlash::studies
