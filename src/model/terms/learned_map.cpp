// SPDX-License-Identifier: BSD-3-Clause
// An effect without a name, as a look-up table over one coordinate x, f(x):
//   acts_on motor, load:  torque f on that end [N m]
//   acts_on gap:          the mesh is displaced by f [rad at the load], x = q_P - q_G + f: both flanks move
//                         together as by a transmission error
//   forward_flank, backward_flank:          that flank is farther away by f [rad at the load]
//   forward_stiffness, backward_stiffness:  that flank bears (1 + f) times its torque, f > -1
// Between its points f is the cubic of Catmull and Rom (1974): the slope at a point is that from its
// neighbour before to that after, 0 at the first and last. Beyond these f is constant. So f has no corners
// and is linear in its values. A gap that follows a position is conservative, and moves both ends through its
// slope; one that follows the torque through the mesh is a spring in series, which must not give way in the
// wrong direction faster than the teeth. It cannot follow speeds or time. Nothing follows the torque of the
// motor, which the model predicts.
#include <algorithm>
#include <cmath>
#include <limits>

#include "backlash_diagnosis/base/error.h"
#include "search_values.h"
#include "terms.h"

namespace backlash::model {
namespace {

class Curve {
 public:
  struct Point {
    double value, slope;
  };

  Curve(const std::vector<double>& points, const std::vector<double>& values)
      : x_(points), y_(values), slope_(points.size(), 0.0) {
    for (std::size_t i = 1; i + 1 < x_.size(); ++i)
      slope_[i] = (y_[i + 1] - y_[i - 1]) / (x_[i + 1] - x_[i - 1]);
  }

  Point at(double x) const {
    if (x <= x_.front()) return {y_.front(), 0};
    if (x >= x_.back()) return {y_.back(), 0};
    const std::size_t j = std::upper_bound(x_.begin(), x_.end(), x) - x_.begin(), i = j - 1;
    const double width = x_[j] - x_[i], t = (x - x_[i]) / width, u = 1 - t;
    const double before = width * slope_[i], after = width * slope_[j], rise = y_[j] - y_[i];
    return {y_[i] + rise * t * t * (3 - 2 * t) + t * u * (before * u - after * t),
            (6 * rise * t * u + before * u * (1 - 3 * t) + after * t * (3 * t - 2)) / width};
  }

 private:
  std::vector<double> x_, y_, slope_;
};

enum class Coordinate { motor_position, load_position, motor_velocity, load_velocity, mesh_torque, time };

/// In the order of Coordinate.
std::vector<std::string> coordinates() {
  return {"motor_position", "load_position", "motor_velocity", "load_velocity", "mesh_torque", "time"};
}

Coordinate coordinate_of(const ParameterValues& p) {
  const std::vector<std::string> names = coordinates();
  const auto found = std::find(names.begin(), names.end(), p.choice("coordinate"));
  return static_cast<Coordinate>(found - names.begin());
}

class LearnedTorque : public Term {
 public:
  explicit LearnedTorque(const ParameterValues& p)
      : on_load_(p.choice("acts_on") == "load"),
        coordinate_(coordinate_of(p)),
        curve_(p.list("points"), p.list("values")) {}
  bool moves_load() const override { return on_load_; }
  bool follows_mesh_torque() const override { return coordinate_ == Coordinate::mesh_torque; }
  void add(const Motion& motion, EndTorques& ends) const override {
    (on_load_ ? ends.load : ends.motor) += curve_.at(coordinate(motion)).value;
  }

 private:
  double coordinate(const Motion& m) const {
    switch (coordinate_) {
      case Coordinate::motor_position:
        return m.motor_position;
      case Coordinate::load_position:
        return m.load_position;
      case Coordinate::motor_velocity:
        return m.motor_velocity;
      case Coordinate::load_velocity:
        return m.load_velocity;
      case Coordinate::mesh_torque:
        return m.mesh_torque;
      case Coordinate::time:
        return m.time;
    }
    return 0;
  }

  bool on_load_;
  Coordinate coordinate_;
  Curve curve_;
};

class LearnedGap : public Term {
 public:
  explicit LearnedGap(const ParameterValues& p)
      : forward_(p.choice("acts_on") != "backward_flank"),
        backward_(p.choice("acts_on") != "forward_flank"),
        displaces_(p.choice("acts_on") == "gap"),
        coordinate_(coordinate_of(p)),
        curve_(p.list("points"), p.list("values")) {
    if (coordinate_ != Coordinate::motor_position && coordinate_ != Coordinate::load_position &&
        coordinate_ != Coordinate::mesh_torque)
      throw InvalidParameter("coordinate", p.choice("coordinate"),
                             "a gap follows motor_position, load_position or mesh_torque");
  }
  bool shapes_flanks() const override { return true; }
  bool shape_follows_torque() const override { return coordinate_ == Coordinate::mesh_torque; }
  void shape(const FlankPoint& at, FlankShift& shift) const override {
    if (!(at.side > 0 ? forward_ : backward_)) return;
    const int opens = displaces_ ? -at.side : 1;
    const bool of_motor = coordinate_ == Coordinate::motor_position;
    const Curve::Point f = curve_.at(shape_follows_torque() ? at.mesh_torque
                                     : of_motor             ? at.motor_position
                                                            : at.load_position);
    shift.opening += opens * f.value;
    if (!shape_follows_torque()) (of_motor ? shift.motor_slope : shift.load_slope) += opens * f.slope;
  }

 private:
  bool forward_, backward_, displaces_;
  Coordinate coordinate_;
  Curve curve_;
};

class LearnedStiffness : public Term {
 public:
  explicit LearnedStiffness(const ParameterValues& p)
      : side_(p.choice("acts_on") == "forward_stiffness" ? 1 : -1),
        of_motor_(coordinate_of(p) == Coordinate::motor_position),
        curve_(p.list("points"), p.list("values")) {
    if (!of_motor_ && coordinate_of(p) != Coordinate::load_position)
      throw InvalidParameter("coordinate", p.choice("coordinate"),
                             "a stiffness follows motor_position or load_position");
    for (const double value : p.list("values"))
      if (!(value > -1)) throw InvalidParameter("values", value, "a stiffness stays above 0: must be > -1");
  }
  bool loads_flanks() const override { return true; }
  void load_flank(const FlankLoad& load, double& torque) const override {
    if (load.at.side == side_)
      torque *=
          std::max(0.0, 1 + curve_.at(of_motor_ ? load.at.motor_position : load.at.load_position).value);
  }

 private:
  int side_;
  bool of_motor_;
  Curve curve_;
};

void check(const std::vector<double>& points, const std::vector<double>& values) {
  if (points.size() < 2) throw InvalidParameter("points", double(points.size()), "needs at least two points");
  if (values.size() != points.size())
    throw InvalidParameter("values", double(values.size()), "one value per point");
  for (std::size_t i = 1; i < points.size(); ++i)
    if (!(points[i] > points[i - 1])) throw InvalidParameter("points", points[i], "must increase");
}

constexpr double kClearStiffness = 0.1;  // of the declared: a change that would show (choice)
constexpr double kSoftest = -0.9;  // of the declared, that a fit may start with: teeth must bear (choice)
constexpr double kAnyValue = -std::numeric_limits<double>::infinity();

double clear_stiffness(const MotionRange&) {
  return kClearStiffness;
}

// Motor and load position differ by the deflection only, and so do the speeds. Of one channel, time would
// explain everything where the torque is commanded in ramps.
std::vector<MapKind> kinds() {
  return {
      {"motor", "motor_position", "rad", "N m", false, clear_torque, kAnyValue},
      {"motor", "motor_velocity", "rad/s", "N m", false, clear_torque, kAnyValue},
      {"motor", "mesh_torque", "N m", "N m", true, clear_torque, kAnyValue},
      {"motor", "time", "s", "N m", true, clear_torque, kAnyValue},
      {"load", "load_position", "rad", "N m", true, clear_torque, kAnyValue},
      {"load", "load_velocity", "rad/s", "N m", true, clear_torque, kAnyValue},
      {"load", "mesh_torque", "N m", "N m", true, clear_torque, kAnyValue},
      {"load", "time", "s", "N m", true, clear_torque, kAnyValue},
      {"gap", "load_position", "rad", "rad", true, clear_angle, kAnyValue},
      {"forward_flank", "load_position", "rad", "rad", true, clear_angle, kAnyValue},
      {"backward_flank", "load_position", "rad", "rad", true, clear_angle, kAnyValue},
      {"forward_stiffness", "load_position", "rad", "-", true, clear_stiffness, kSoftest},
      {"backward_stiffness", "load_position", "rad", "-", true, clear_stiffness, kSoftest},
  };
}

}  // namespace

TermType learned_map_term() {
  TermType type{
      "learned_map",
      {{"acts_on",
        "-",
        Range::any(),
        "what it is added to",
        false,
        {"motor", "load", "gap", "forward_flank", "backward_flank", "forward_stiffness",
         "backward_stiffness"}},
       {"coordinate", "-", Range::any(), "x", false, coordinates()},
       {"points", "rad, rad/s, N m or s", Range::any(), "of x, increasing", true},
       {"values", "N m, of a gap or flank rad, of a stiffness -", Range::any(), "f at each point", true}},
      [](const ParameterValues& p) -> std::unique_ptr<Term> {
        check(p.list("points"), p.list("values"));
        const std::string& on = p.choice("acts_on");
        if (on == "motor" || on == "load") return std::make_unique<LearnedTorque>(p);
        if (on == "forward_stiffness" || on == "backward_stiffness")
          return std::make_unique<LearnedStiffness>(p);
        return std::make_unique<LearnedGap>(p);
      }};
  type.map = TermMap{"acts_on", "coordinate", "points", "values", kinds()};
  return type;
}

}  // namespace backlash::model
