// SPDX-License-Identifier: BSD-3-Clause
// The family of amplitude probability distributions that a rig shows as its backlash grows, in their
// cumulative form, and how far a record's distribution is from it.
//
// A distribution is held as its quantile function Q at the probabilities (k + 1/2) / 100, so that no class
// borders blur it. The distance of two distributions is the mean square difference of their quantile
// functions, the squared Wasserstein metric of second order in one dimension:
//   T = 1/100 sum_k (Q_k - Q'_k)^2                                                  (unit of the signal)^2
// A recorder does not know where between its samples the excitation switches: the family has members for
// several such phases. Between two backlash values each phase is interpolated linearly in Q, which makes T
// quadratic there; the distance of a record is the smallest over the phases.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace backlash::diagnosis {

constexpr int kQuantiles = 100;
using Quantiles = std::vector<double>;  ///< kQuantiles values, not decreasing

/// Quantile function of samples (at least one), interpolated linearly between the sorted samples (Hazen
/// 1914). Throws InvalidParameter without samples.
Quantiles quantiles_of(std::vector<double> samples);

/// Quantile function of the same signal plus independent normal noise of standard deviation sigma >= 0.
Quantiles with_noise(const Quantiles& exact, double sigma);

/// Calibration from simulated records with a backlash between two neighbouring values of the family. A record
/// accepts a backlash b where T(b) <= T_min + threshold max(T_min, floor), T_min its smallest distance.
struct FamilySegment {
  double floor = 0;               // T of noise-free records, by interpolation and irregular motion
  std::vector<double> threshold;  // per noise level: 95 % of the records accept their own backlash
  std::vector<double> misfit;     // per noise level: largest root of T_min among the records
};

class NoisyFamilies;

/// Members by backlash value and phase, free of noise; one segment between each two backlash values of the
/// curve. Members beyond those of the curve's points, as far apart as the last two, only serve to recognise
/// backlash that is larger than the curve covers.
struct ApdFamily {
  ApdFamily();
  std::vector<std::vector<Quantiles>> members;
  std::vector<FamilySegment> segments;
  /// What has been compared with records before; shared by copies, so members must not change from then on.
  std::shared_ptr<NoisyFamilies> compared;
};

/// The members as noise of standard deviation sigma >= 0 shows them, ready for being compared with many
/// records.
class NoisyFamily {
 public:
  NoisyFamily(const ApdFamily& family, double sigma);

 private:
  friend class FamilyDistance;
  Eigen::Index column(std::size_t member, std::size_t phase) const {
    return static_cast<Eigen::Index>(phase * count_ + member);
  }

  std::size_t count_, phases_;  // members of a phase, phases
  Eigen::VectorXd middle_;      // of all members; what follows is relative to it
  Eigen::MatrixXd members_;     // a column each
  Eigen::VectorXd square_;      // of each
  Eigen::VectorXd neighbours_;  // product of each with the next of its phase
};

/// A family with the noise of the records that it was compared with lately, so that the next record of the
/// same machine costs no more than its distances. Safe to use from several threads.
class NoisyFamilies {
 public:
  /// With the noise nearest to sigma >= 0 of levels 3 % apart; noise is known less precisely than that.
  std::shared_ptr<const NoisyFamily> at(const ApdFamily& family, double sigma);

 private:
  struct CachedFamily {
    long level;
    std::shared_ptr<const NoisyFamily> family;
  };
  std::mutex mutex_;
  std::list<CachedFamily> cached_;  // the last that was asked for first
};

/// Distance of one observed distribution from all members, over backlash. Positions are segment + share: the
/// backlash value that lies at `share` [0, 1] between those of the segment's two ends.
class FamilyDistance {
 public:
  FamilyDistance(const NoisyFamily& family, const Quantiles& observed);

  double at(std::size_t segment, double share) const;

  struct Place {
    double distance = 0;
    std::size_t segment = 0;
    double share = 0;
  };
  const Place& smallest() const { return smallest_; }

  /// The shares of a segment where the distance is <= limit, as intervals that may overlap.
  std::vector<std::pair<double, double>> within(std::size_t segment, double limit) const;

 private:
  /// Coefficients of T(share) = (a share + b) share + c of one phase.
  struct Parabola {
    double a, b, c;
    double at(double share) const { return (a * share + b) * share + c; }
    double lowest() const;  // share in [0, 1]
  };
  std::vector<Parabola> parabolas_;  // by segment, then phase
  std::size_t phases_;
  Place smallest_;
};

}  // namespace backlash::diagnosis
