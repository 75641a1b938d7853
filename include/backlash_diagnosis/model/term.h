// SPDX-License-Identifier: BSD-3-Clause
// An effect is a term of the model: a torque on the motor or the load, dry friction, a change of the shape or
// stiffness of the flanks, or an error of a sensor.
//
// A new effect: one file in src/model/terms/ with its equation, and one line in term.cpp. A term with a
// TermSearch also becomes a candidate in the search for what a model lacks.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/parameter.h"

namespace backlash::model {

/// What a term may depend on; all at the load side of the reduction.
struct Motion {
  double time;            // s
  double motor_position;  // rad
  double motor_velocity;  // rad/s
  double load_position;   // rad
  double load_velocity;   // rad/s
  // N m, through the teeth, > 0 drives the load forward; of a rigid train the torque that the load takes
  // (GearTrain)
  double mesh_torque = 0;
};

/// Torques on the two ends of the gear train [N m], load-side; positive torque accelerates in positive
/// direction.
struct EndTorques {
  double motor = 0;
  double load = 0;
};

/// Dry friction of one body: the largest torque >= 0 [N m] with which it opposes motion, or the attempt to
/// start it, in either direction.
struct FrictionLimits {
  double forward = 0;
  double backward = 0;
  // rad, constant, over which friction builds up after a reversal (Presliding); 0: at once
  double presliding = 0;
  double presliding_damping =
      0;  // N m s/rad, damping of the presliding friction, sigma_1 of LuGre (see Presliding)
};

struct EndFriction {
  FrictionLimits motor, load;
};

/// Displacement of a flank from where the rig file puts it, as an angle at the load.
struct FlankShift {
  double opening = 0;      // rad, > 0: farther away
  double motor_slope = 0;  // d opening / d motor position
  double load_slope = 0;   // d opening / d load position
};

/// A position at which the shape of a flank is evaluated; angles at the load.
struct FlankPoint {
  double motor_position;  // rad
  double load_position;   // rad
  double half_gap;        // rad, of the rig
  double mesh_torque;     // N m, through the teeth
  int side;               // +1: touches where the motor drives forward, -1: the other
};

/// A flank under load.
struct FlankLoad {
  FlankPoint at;
  double penetration;  // rad at the load, > 0
  double rate;         // rad/s, of the penetration
};

/// Errors of sensors and drive.
struct Sensing {
  double load_position_gain = 1;  // -, shown over true
  double torque_delay = 0;        // s, by which the torque acts later than its stamp
};

class Term {
 public:
  virtual ~Term() = default;

  std::string id;          // in the rig file; set by make_term()
  ParameterValues values;  // that it was made of; set by make_term()

  /// Adds torques that are a smooth function of the motion.
  virtual void add(const Motion&, EndTorques&) const {}

  /// Adds dry friction. Whether a body sticks or slides is found by the simulation.
  virtual bool has_dry_friction() const { return false; }
  virtual void add_friction(const Motion&, EndFriction&) const {}

  /// Shifts the flanks; such a term adds no torque. The mesh torque acts on both ends through the slopes of
  /// the shift, which conserves energy.
  virtual bool shapes_flanks() const { return false; }
  virtual bool shape_follows_torque() const { return false; }
  virtual void shape(const FlankPoint&, FlankShift&) const {}
  /// The smallest opening [rad] of a flank at any position, with this half gap; -infinity if that is not
  /// known.
  virtual double least_opening(double /*half_gap*/) const { return -std::numeric_limits<double>::infinity(); }

  /// Adds to the contact torque of a closed flank [N m], and to nothing else. A flank never pulls: the sum is
  /// limited to >= 0.
  virtual bool loads_flanks() const { return false; }
  virtual void load_flank(const FlankLoad&, double& /*torque*/) const {}

  /// Whether it reads Motion::mesh_torque. A term must not read the motor's torque, which the model predicts.
  virtual bool follows_mesh_torque() const { return false; }
  /// Share of the inertia of one body, 0 to 1, that turns before the teeth and does not load them.
  virtual double rotor_share() const { return 0; }

  virtual void sense(Sensing&) const {}

  /// False for a term that acts on the motor or on a sensor only. With a recorded motor the load then moves
  /// as without the term, and need not be simulated again.
  virtual bool moves_load() const { return true; }
};

/// The range of the motion in the records, from which a term derives the values to try. At the load side.
struct MotionRange {
  double torque = 0;        // N m, standard deviation of the motor's
  double speed = 0;         // rad/s, standard deviation of the motor's
  double deflection = 0;    // rad, standard deviation of motor minus load
  double from = 0, to = 0;  // rad, where the motor has been
  double duration = 0;      // s, of the longest record
  double interval = 0;      // s, between samples
};

/// One sample of a motion, for an effect carrier * sin(order * position + phase).
struct WaveMoment {
  double position;  // rad, of which the order is the number of waves per radian
  double speed;     // rad/s, of that position
  double carrier;   // +1 or -1; 0 where the effect does not show
};

/// In which residual an effect with an order appears, as a wave over which position.
struct WaveOver {
  bool deflection;  // true: in the residual of the deflection; false: of the torque
  WaveMoment (*at)(const Motion&, const ParameterValues& choices);
};

/// A parameter in which a term is not linear, and the values that are tried for it.
struct TermShape {
  std::string name;
  std::vector<double> (*values)(const MotionRange&);
  bool refined;  // the best value is then fitted with all other parameters; else it stays one of the values
  // Of an order, which may be any number > 0: orders that a spectrum of the residual shows are tried too.
  std::optional<WaveOver> wave = std::nullopt;
  // > 0: it stays 0 until the effect is found; then it is fitted too, from these values (> 0) as starts,
  // together with those of the same number, one number after the other.
  int later = 0;
  bool of_one_body = false;  // nothing where the load is behind teeth
};

/// 1/rad: orders that differ by less are hard to distinguish over the travel; infinite where nothing moves.
double order_resolution(const MotionRange&);

/// How the search for what a model lacks tries a term: the strength is fitted for each combination of choices
/// and shapes.
struct TermSearch {
  std::string strength;  // the parameter that is 0 if the effect is absent
  std::string phase;     // of an effect strength * sin(... + phase), tried in sine and cosine; empty: none
  double (*typical)(const MotionRange&) = nullptr;  // a strength, > 0, that such records would clearly show
  std::vector<TermShape> shapes;
  bool pairs = false;               // also two such terms at once, with different values of their one shape
  bool needs_turning_link = false;  // has no effect on a locked link
};

/// One kind of look-up table that is learned from records: the quantity that its values are added to, and the
/// coordinate.
struct MapKind {
  std::string acts_on, coordinate;  // choices of TermMap::acts_on and TermMap::coordinate
  std::string coordinate_unit, unit;
  bool needs_load;                        // only for a load that moves freely
  double (*typical)(const MotionRange&);  // a value, > 0, that such records would clearly show
  double least;                           // value that a fit may start with; -infinity: any
};

/// A term whose law is a look-up table learned from data: it shows that there is an effect, but not which.
struct TermMap {
  std::string acts_on, coordinate, points, values;  // its parameters
  std::vector<MapKind> kinds;                       // that are learned
};

/// A calibration of the record that a term describes too. If such a term is in the model, its strength starts
/// from the calibrated value, and that calibration is no longer fitted.
enum class Calibrates { nothing, torque_delay };

/// In which form a term makes the backlash depend on the position of the load.
enum class GapVariation { none, harmonic, table };

/// What the registry knows of a term: its id in the rig file, its parameters, how it is made.
struct TermType {
  std::string id;
  std::vector<ParameterSpec> parameters;
  std::unique_ptr<Term> (*create)(const ParameterValues&);
  std::optional<TermSearch> search = std::nullopt;  // none: it is never sought
  std::optional<TermMap> map = std::nullopt;
  Calibrates calibrates = Calibrates::nothing;
  GapVariation gap_variation = GapVariation::none;
  // The term describes how friction builds up after a reversal. Every machine has that, so it is reported as
  // missing only if the record shows it.
  bool shapes_friction = false;
  // Of effects that every machine has to some extent: a strength up to these fractions of the motor's dry
  // friction, of the backlash angle, and as one wave per turn of a declared weight, or a share up to this
  // one, is put into the model, but not reported as missing.
  double usual_of_friction = 0, usual_of_gap = 0, usual_of_weight = 0, usual_share = 0;
  // Together with the declared contact law it can do what another contact law would do alone.
  bool stands_in_for_contact_law = false;
};

/// By id; throws InvalidParameter for one that is not in the registry.
const TermType& term_type(const std::string& id);

/// The first type for which `can` is true; throws InvalidParameter if there is none.
const TermType& term_type_that(bool (*can)(const TermType&));

/// All terms. There is no second list of effects anywhere.
const std::vector<TermType>& term_types();

/// One term from its values, which must be all that its type names. Throws InvalidParameter for another id,
/// for values that are out of range or contradict each other.
std::shared_ptr<const Term> make_term(const std::string& id, const ParameterValues& values);

/// The errors of sensors and drive of all terms together.
Sensing sensing(const std::vector<std::shared_ptr<const Term>>& terms);

/// Reads one entry of `terms:`: `id: ID` and that term's parameters.
std::shared_ptr<const Term> read_term(const YamlReader& yaml);

}  // namespace backlash::model
