// SPDX-License-Identifier: BSD-3-Clause
// Planned motions against limits, closed forms of a single link, a singular value decomposition of
// definitions, KDL, and in the end against the diagnosis of simulated arms.
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <complex>
#include <filesystem>
#include <fstream>

#include "arm/arm_machines.h"
#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/geared_arm/motion_file.h"
#include "backlash_diagnosis/geared_arm/simulation.h"
#include "geared_arm/base_information.h"
#include "support/data.h"

namespace backlash::geared_arm {
namespace {

GearedArm arm_of(const std::string& name) {
  return load_geared_arm(test::package_file("config/" + name + ".yaml"));
}

/// A search that is short.
PlanSettings quick(std::uint64_t seed = 1) {
  PlanSettings s;
  s.seed = seed;
  s.motions = 20;
  s.bettered = 1;
  s.steps = 300;
  return s;
}

MotionPlan planned(const GearedArm& arm, const PlanSettings& settings) {
  return plan_motion(arm, load_motion_limits(arm, std::nullopt), settings);
}

/// The series and its derivatives as the real part of a sum of turning arrows, in other words than the code.
std::array<double, 3> arrows(const simulation::FourierMotion& m, double s) {
  std::complex<double> sum[3] = {m.offset, 0, 0};
  for (std::size_t i = 0; i < m.cosines.size(); ++i) {
    const std::complex<double> rate(0, 2 * M_PI * double(i + 1) / m.period);
    const std::complex<double> arrow = std::complex<double>(m.cosines[i], -m.sines[i]) * std::exp(rate * s);
    sum[0] += arrow, sum[1] += rate * arrow, sum[2] += rate * rate * arrow;
  }
  return {sum[0].real(), sum[1].real(), sum[2].real()};
}

class MotionPlans : public testing::TestWithParam<std::pair<const char*, int>> {};  // rig file, harmonics

TEST_P(MotionPlans, HoldTheLimitsBetweenTheTimesOfTheSearchToo) {
  const GearedArm arm = arm_of(GetParam().first);
  const std::vector<MotionLimits> limits = load_motion_limits(arm, std::nullopt);
  PlanSettings settings = quick();
  settings.steps = 60;
  settings.harmonics = GetParam().second;
  const MotionPlan plan = plan_motion(arm, limits, settings);
  ASSERT_EQ(plan.joints.size(), limits.size());
  for (std::size_t j = 0; j < limits.size(); ++j) {
    const simulation::FourierMotion& m = plan.joints[j].motion;
    double largest[3] = {0, 0, 0};                             // relative to the limit
    for (double s = 0; s < m.period; s += m.period / 30011) {  // no multiple of the search's grid
      const auto [q, v, a] = arrows(m, s);
      EXPECT_GE(q, limits[j].lower - 1e-9);
      EXPECT_LE(q, limits[j].upper + 1e-9);
      largest[1] = std::fmax(largest[1], std::fabs(v) / limits[j].speed);
      largest[2] = std::fmax(largest[2], std::fabs(a) / limits[j].acceleration);
    }
    for (double t = 0; t < m.approach; t += 1e-3) {
      const simulation::Kinematics k = simulation::kinematics(m, t);
      EXPECT_GE(k.position, limits[j].lower - 1e-9);
      EXPECT_LE(k.position, limits[j].upper + 1e-9);
      largest[1] = std::fmax(largest[1], std::fabs(k.velocity) / limits[j].speed);
      largest[2] = std::fmax(largest[2], std::fabs(k.acceleration) / limits[j].acceleration);
    }
    EXPECT_LE(largest[1], 1 + 1e-9) << plan.joints[j].joint;
    EXPECT_LE(largest[2], 1 + 1e-9) << plan.joints[j].joint;
    const auto [q, v, a] = arrows(m, 0);
    EXPECT_NEAR(v, 0, 1e-12);
    EXPECT_NEAR(a, 0, 1e-12);
    EXPECT_EQ(m.start, limits[j].start);
  }
}

INSTANTIATE_TEST_SUITE_P(Arms, MotionPlans,
                         testing::Values(std::pair{"two_link_arm/two_link_arm", 5},
                                         std::pair{"ur10e_arm/ur10e_arm_geared", 2},
                                         std::pair{"ur10e_arm/ur10e_arm_geared", 20}),
                         [](const auto& info) {
                           return std::string(info.param.first).substr(0, 3) +
                                  std::to_string(info.param.second);
                         });

/// The torque that KDL wants for the motion, with the drive's share.
TEST(MotionPlan, MotorsHoldTheirTorqueByAnotherDynamics) {
  const GearedArm arm = arm_of("two_link_arm/two_link_arm");
  std::vector<MotionLimits> limits = load_motion_limits(arm, std::nullopt);
  limits[0].torque = 9;  // gravity alone takes up to 8.8 N m with the arm held out
  const MotionPlan plan = plan_motion(arm, limits, quick());
  const KDL::Chain kdl = test::to_kdl(arm.rig.chain);
  KDL::ChainIdSolver_RNE solver(kdl, KDL::Vector(0, 0, -9.80665));
  double largest = 0;
  for (double t = 0; t < plan.settings.period + plan.joints[0].motion.approach; t += 0.013) {
    arm::Joints q(2), v(2), a(2);
    for (int j = 0; j < 2; ++j) {
      const simulation::Kinematics k = simulation::kinematics(plan.joints[std::size_t(j)].motion, t);
      q[j] = k.position, v[j] = k.velocity, a[j] = k.acceleration;
    }
    KDL::JntArray torque{2};
    solver.CartToJnt(test::to_kdl(q), test::to_kdl(v), test::to_kdl(a),
                     KDL::Wrenches(kdl.getNrOfSegments(), KDL::Wrench::Zero()), torque);
    largest =
        std::fmax(largest, std::fabs(torque(0) + 0.12 * a[0] + 0.45 * std::tanh(v[0] / 0.02) + 0.32 * v[0]));
  }
  // The plan looks at other times: a torque changes by less than 1 % within 0.02 s at these speeds.
  EXPECT_NEAR(plan.joints[0].torque, largest, 0.01 * largest);
  EXPECT_LE(plan.joints[0].torque, 9);
}

TEST(MotionPlan, IsTheSameForASeed) {
  const GearedArm arm = arm_of("two_link_arm/two_link_arm");
  PlanSettings settings = quick(5);
  settings.steps = 40;
  const std::string once = motion_text(planned(arm, settings));
  EXPECT_EQ(motion_text(planned(arm, settings)), once);
  settings.seed = 6;
  EXPECT_NE(motion_text(planned(arm, settings)), once);
}

/// Eigen::BDCSVD takes four times as long to compile.
using Singular = Eigen::JacobiSVD<Eigen::MatrixXd>;

/// Y by its definition: the torque of each unit parameter.
Eigen::MatrixXd defined_regressor(const GearedArm& arm, const arm::Joints& q, const arm::Joints& v,
                                  const arm::Joints& a) {
  const Eigen::Index n = q.size();
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(n, 13 * n);
  arm::Chain unit = arm.rig.chain;
  for (Eigen::Index i = 0; i < 10 * n; ++i) {
    for (arm::BodyParameters& link : unit.links) link.setZero();
    unit.links[std::size_t(i / 10)][i % 10] = 1;
    y.col(i) = arm::inverse_dynamics(unit, q, v, a);
  }
  for (Eigen::Index j = 0; j < n; ++j)
    y.block(j, 10 * n + 3 * j, 1, 3) << a[j], std::tanh(v[j] / arm.rig.identification.friction_speed), v[j];
  return y;
}

TEST(MotionPlan, InformationIsThatOfTheSingularValues) {
  for (const std::string name : {"two_link_arm/two_link_arm", "ur10e_arm/ur10e_arm_geared"}) {
    const GearedArm arm = arm_of(name);
    const std::vector<MotionLimits> limits = load_motion_limits(arm, std::nullopt);
    const auto n = Eigen::Index(limits.size());
    std::vector<double> noise;
    for (Eigen::Index j = 0; j < n; ++j) noise.push_back(0.1 + 0.05 * double(j));
    const BaseInformation information(arm.rig, limits, noise, 1);
    Random random(7);
    const Eigen::Index rows = 150;
    JointMotions motion{Eigen::MatrixXd(rows, n), Eigen::MatrixXd(rows, n), Eigen::MatrixXd(rows, n)};
    Eigen::MatrixXd all(rows * n, 13 * n);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const arm::Joints q = test::random_joints(random, n, 1), v = test::random_joints(random, n, 1),
                        a = test::random_joints(random, n, 3);
      motion.q.row(i) = q, motion.v.row(i) = v, motion.a.row(i) = a;
      all.middleRows(i * n, n) = defined_regressor(arm, q, v, a);
      for (Eigen::Index j = 0; j < n; ++j) all.row(i * n + j) /= noise[std::size_t(j)];
    }
    const Eigen::VectorXd size = all.colwise().norm().transpose().cwiseMax(1e-6);
    Singular rank(all * size.cwiseInverse().asDiagonal());
    rank.setThreshold(
        1e-6);  // between 0.1, the least that these motions show, and rounding of empty columns, 1e-8
    EXPECT_EQ(Eigen::Index(information.parameters()), rank.rank()) << name;
    // Of links 6 where two turn in a plane; of six in space 7 n - 4, less 2 as the first axis is along
    // gravity (Gautier and Khalil 1990, IEEE T-RA 6:368); three per drive, but the rotor of the first joint,
    // and of the second of such an arm, is in the links' own inertia.
    EXPECT_EQ(information.parameters(), n == 2 ? 6u + 6 - 1 : 36u + 18 - 2) << name;
    // With the delay of each joint's torque: its rate in the joint's own rows.
    Eigen::MatrixXd rate(rows, n);
    for (Eigen::Index i = 0; i < rows; ++i) rate.row(i) = test::random_joints(random, n, 4);
    Eigen::MatrixXd base = Eigen::MatrixXd::Zero(all.rows(), Eigen::Index(information.parameters()) + n);
    for (Eigen::Index c = 0; c < base.cols() - n; ++c)
      base.col(c) = all.col(information.columns()[std::size_t(c)]);
    for (Eigen::Index i = 0; i < rows; ++i)
      for (Eigen::Index j = 0; j < n; ++j)
        base(i * n + j, base.cols() - n + j) = rate(i, j) / noise[std::size_t(j)];
    const Eigen::VectorXd length = base.colwise().norm().transpose();
    const Eigen::VectorXd s = Singular(base * length.cwiseInverse().asDiagonal()).singularValues();
    const MotionInformation found = information.of(motion, rate, 1);
    EXPECT_NEAR(found.condition, s[0] / s[s.size() - 1], 1e-6 * found.condition) << name;
    // Scales of the columns are the same for any two motions: half of the noise adds log 2 per
    // parameter.
    for (double& each : noise) each /= 2;
    EXPECT_NEAR(BaseInformation(arm.rig, limits, noise, 1).of(motion, rate, 1).log_volume - found.log_volume,
                double(base.cols()) * std::log(2.0), 1e-6);
    // Every other row has less, by what the singular values say.
    Eigen::MatrixXd even(base.rows() / 2, base.cols());
    for (Eigen::Index i = 0; i < rows / 2; ++i) even.middleRows(i * n, n) = base.middleRows(2 * i * n, n);
    const auto volume = [](const Eigen::MatrixXd& y) {
      return Singular(y).singularValues().array().log().sum();
    };
    for (double& each : noise) each *= 2;
    EXPECT_NEAR(found.log_volume - information.of(motion, rate, 2).log_volume, volume(base) - volume(even),
                1e-5 * double(base.cols()))
        << name;
  }
}

/// One link that turns about a horizontal axis, level at 0: gravity m g d cos q.
class OneLink : public testing::Test {
 protected:
  static constexpr double kMass = 2, kDistance = 0.25, kAbout = 0.01;  // kg, m, kg m^2 about its centre
  static constexpr double kGravity = kMass * kDistance * 9.80665;
  static constexpr double kInertia = kAbout + kMass * kDistance * kDistance;

  void SetUp() override {
    std::string pattern = (std::filesystem::path(testing::TempDir()) / "one_link_XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    write("link.urdf", R"(<robot name="one"><link name="base"/><link name="arm"><inertial>
      <origin xyz="0.25 0 0"/><mass value="2"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
      <joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 -1 0"/>
      <limit lower="-3" upper="3" effort="60" velocity="3"/></joint></robot>)");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }

  GearedArm arm(const std::string& limits,
                const std::string& drive = "rotor_inertia: 0.1, coulomb: 0.2, ") const {
    write("rig.yaml",
          "schema_version: 1\nname: one\nurdf: link.urdf\ngravity: [0, 0, -9.80665]\n"
          "drives: {channel: motor_torque, terms: [rotor_inertia, coulomb]}\n"
          "joints:\n  - {name: hinge, " +
              drive + "motion_limits: " + limits +
              "}\nidentification: {kinematics_cutoff: 20, torque_cutoff: 10, slowest: 0.02, friction_speed: "
              "0.02}\n");
    return load_geared_arm((folder_ / "rig.yaml").string());
  }

  std::filesystem::path folder_;
};

TEST_F(OneLink, GravityThatNoMotionTurnsHidesTheGap) {
  const GearedArm a = arm("{lower: -0.6, upper: 0.6, acceleration: 5}");
  const MotionPlan plan = planned(a, quick());
  const JointPlan& joint = plan.joints[0];
  EXPECT_EQ(joint.view, GapView::impossible);
  EXPECT_FALSE(plan.none_hidden());
  // The least load: at the end of the range, with all of the acceleration.
  const double least = kGravity * std::cos(0.6) - kInertia * 5, most = kGravity + kInertia * 5;
  ASSERT_GT(least, 0);
  EXPECT_NEAR(joint.reach[0], -least, 1e-3 * most);  // of a search at random
  EXPECT_NEAR(joint.reach[1], most, 1e-3 * most);
  ASSERT_EQ(joint.hidden.size(), 1u);
  EXPECT_EQ(joint.hidden[0].flank, 1);
  EXPECT_NEAR(joint.hidden[0].lower, -0.6, 1e-9);
  EXPECT_NEAR(joint.hidden[0].upper, 0.6, 1e-9);
  EXPECT_NE(joint.message.find("takes the load off the positive flank"), std::string::npos) << joint.message;
  EXPECT_NE(joint.message.find("gravity holds it from -0.60 to 0.60 rad on the positive flank"),
            std::string::npos)
      << joint.message;
}

TEST_F(OneLink, PosesThatHideTheGapEndWhereTheirClosedFormDoes) {
  for (const double acceleration : {5.0, 20.0}) {  // gravity must be certain; acceleration must not turn it
    const JointPlan joint =
        planned(arm("{acceleration: " + std::to_string(acceleration) + "}"), quick()).joints[0];
    EXPECT_EQ(joint.view, GapView::shown) << joint.message;
    const double turned = kInertia * acceleration - joint.certain;
    EXPECT_EQ(turned > joint.certain, acceleration > 10);
    const double edge = std::acos(std::fmax(joint.certain, turned) / kGravity);
    ASSERT_EQ(joint.hidden.size(), 3u);
    const double fine = M_PI / 180;  // the step of the ranges
    EXPECT_NEAR(joint.hidden[0].upper, edge - M_PI, fine);
    EXPECT_EQ(joint.hidden[0].flank, -1);
    EXPECT_NEAR(joint.hidden[1].lower, -edge, fine);
    EXPECT_NEAR(joint.hidden[1].upper, edge, fine);
    EXPECT_EQ(joint.hidden[1].flank, 1);
    EXPECT_NEAR(joint.hidden[2].lower, M_PI - edge, fine);
  }
}

TEST_F(OneLink, WhereAccelerationTurnsTheLoadNothingIsHidden) {
  const MotionPlan plan = planned(arm("{lower: -0.6, upper: 0.6, acceleration: 100}"), quick());
  EXPECT_GT(plan.joints[0].reach[0], 0);
  EXPECT_NE(plan.joints[0].view, GapView::impossible);
  EXPECT_TRUE(plan.joints[0].hidden.empty());
}

TEST_F(OneLink, ALoadThatADriveOfWhichNothingIsKnownMayHideIsNotCalledShown) {
  const MotionPlan plan = planned(arm("{acceleration: 5}", ""), quick());
  EXPECT_EQ(plan.joints[0].view, GapView::unconfirmed);
  EXPECT_TRUE(plan.none_hidden());
  EXPECT_NE(plan.joints[0].message.find("states neither its rotor nor its friction"), std::string::npos);
}

TEST_F(OneLink, LimitsThatAreMissingOrDoNotFitAreRefused) {
  const auto refused = [&](const std::string& limits, const std::string& words) {
    const GearedArm a = arm(limits);
    try {
      load_motion_limits(a, std::nullopt);
      ADD_FAILURE() << limits;
    } catch (const BadData& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  refused("{lower: -1}", "no limit of the acceleration");
  refused("{lower: -4, acceleration: 5}", "rig.yaml:7: joints[0].motion_limits.lower = -4");
  refused("{speed: 9, acceleration: 5}", "speed = 9");
  refused("{torque: 99, acceleration: 5}", "torque = 99");
  refused("{acceleration: 0}", "acceleration = 0");
  refused("{lower: 1, upper: 0, acceleration: 5}", "must be > lower");
  refused("{lower: 1, acceleration: 5}", "starts at 0 rad, outside its limits 1 to 3 rad");
  refused("{acceleration: 5, jerk: 3}", "jerk");
  EXPECT_EQ(load_motion_limits(arm("{lower: -1}"), 7)[0].acceleration, 7);
  std::string urdf =
      "<robot name='one'><link name='base'/><link name='arm'><inertial><mass value='2'/>"
      "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>"
      "<joint name='hinge' type='continuous'><parent link='base'/><child link='arm'/></joint></robot>";
  write("link.urdf", urdf);
  refused("{acceleration: 5}", "no limit of the lower: neither motion_limits.lower here nor <limit lower>");
  refused("{lower: -1, upper: 1, acceleration: 5}", "no limit of the speed");
}

TEST_F(OneLink, AFileSaysTheSameMotion) {
  const MotionPlan plan = planned(arm("{acceleration: 5}"), quick());
  write("motion.yaml", motion_text(plan));
  const PlannedMotion read = read_motion((folder_ / "motion.yaml").string());
  EXPECT_EQ(read.joints, std::vector<std::string>{"hinge"});
  const simulation::FourierMotion &a = read.motions[0], &b = plan.joints[0].motion;
  EXPECT_EQ(a.cosines, b.cosines);
  EXPECT_EQ(a.sines, b.sines);
  EXPECT_EQ(a.offset, b.offset);
  EXPECT_EQ(a.approach, b.approach);
  GearedArm other = arm_of("two_link_arm/two_link_arm");
  EXPECT_THROW(follow(other, read), BadData);
}

TEST_F(OneLink, TheTrajectoryEndsAtRest) {
  const GearedArm a = arm("{acceleration: 5}");
  const MotionPlan plan = planned(a, quick());
  std::istringstream csv(trajectory_csv(a, plan, 50));
  std::string line, last;
  std::getline(csv, line);
  EXPECT_EQ(line,
            "time,hinge/reference_position,hinge/reference_velocity,hinge/reference_acceleration,hinge/"
            "mesh_torque");
  long rows = 0;
  while (std::getline(csv, line)) last = line, ++rows;
  EXPECT_EQ(rows, 1 + std::lround((plan.joints[0].motion.approach + 20) * 50));
  double t = 0, q = 0, speed = 1, acceleration = 1, mesh = 0;
  ASSERT_EQ(std::sscanf(last.c_str(), "%lf,%lf,%lf,%lf,%lf", &t, &q, &speed, &acceleration, &mesh), 5);
  EXPECT_NEAR(speed, 0, 1e-9);
  EXPECT_NEAR(acceleration, 0, 1e-9);
  EXPECT_NEAR(mesh, kGravity * std::cos(q), 1e-4);  // at rest; printed with six digits
  EXPECT_THROW(trajectory_csv(a, plan, 0), InvalidParameter);
}

/// The proof: a simulated arm that follows the motion shows its plays, the motion of its file does not.
TEST(MotionPlan, ShowsThePlaysThatTheMotionOfTheFileHides) {
  const GearedArm declared = arm_of("two_link_arm/two_link_arm_hidden");
  const MotionPlan plan = planned(declared, quick());
  ASSERT_TRUE(plan.none_hidden());
  const std::string path = (std::filesystem::path(testing::TempDir()) / "plan_of_two_links.yaml").string();
  std::ofstream(path) << motion_text(plan);
  GearedArm machine = declared;
  follow(machine, read_motion(path));
  std::filesystem::remove(path);
  std::vector<JointLoad> loads;
  for (const GearedJoint& joint : declared.joints) loads.push_back({joint.link_coulomb, joint.link_viscous});
  std::vector<std::string> warnings;
  const double duration = plan.joints[0].motion.approach + 2 * plan.settings.period;
  const auto records = simulate_arm(machine, duration);
  // The loops follow: within what friction and gravity's compensation at 1 kHz leave of a gain of 8 /s.
  for (std::size_t j = 0; j < 2; ++j) {
    const auto& q = records[j].record.column(record::Channel::motor_position);
    for (std::size_t k = 0; k < q.size(); k += 100)
      EXPECT_NEAR(q[k], simulation::kinematics(plan.joints[j].motion, records[j].record.time[k]).position,
                  0.03);
  }
  const auto plays =
      plays_of(declared.rig, loads, arm::arm_record(records, declared.rig, "simulated"), warnings);
  const double truth[] = {2e-3, 3e-3};
  for (std::size_t j = 0; j < 2; ++j) {
    const diagnosis::Estimate& e = plays[j].estimate;
    ASSERT_EQ(e.status, diagnosis::Status::ok) << e.message;
    EXPECT_LE(e.angle_lower, truth[j]);
    EXPECT_GE(e.angle_upper, truth[j]);
    EXPECT_NEAR(e.backlash_angle, truth[j], 0.1 * truth[j]);  // within 10 %, as in doc/evidence/arm.md
    // As many stays as were promised in each of the two periods, at least.
    EXPECT_GE(plays[j].stays[0], 2 * plan.joints[j].stays[0]);
    EXPECT_GE(plays[j].stays[1], 2 * plan.joints[j].stays[1]);
  }
}

/// Of six joints the one that gravity does not load is reported as such, with its reason; the lift, which the
/// motion of the file hides, is shown.
TEST(MotionPlan, OfSixJointsItSaysWhichGapsAreShown) {
  const GearedArm declared = arm_of("ur10e_arm/ur10e_arm_geared");
  PlanSettings settings = quick();
  settings.steps = 1500;
  const MotionPlan plan = planned(declared, settings);
  for (std::size_t j = 0; j < 5; ++j)
    EXPECT_EQ(plan.joints[j].view, GapView::shown) << plan.joints[j].joint << ": " << plan.joints[j].message;
  EXPECT_EQ(plan.joints[5].view, GapView::impossible);
  EXPECT_TRUE(plan.joints[5].hidden.empty());
  EXPECT_NE(plan.joints[5].message.find("friction and the noise of its torque hide a load"),
            std::string::npos);
  EXPECT_FALSE(plan.joints[1].hidden.empty());
  EXPECT_GT(plan.gain, 1);
  const std::string path = (std::filesystem::path(testing::TempDir()) / "plan_of_six_joints.yaml").string();
  std::ofstream(path) << motion_text(plan);
  GearedArm machine = declared;
  follow(machine, read_motion(path));
  std::filesystem::remove(path);
  std::vector<JointLoad> loads;
  for (const GearedJoint& joint : declared.joints) loads.push_back({joint.link_coulomb, joint.link_viscous});
  std::vector<std::string> warnings;
  const auto records = simulate_arm(machine, plan.joints[0].motion.approach + 2 * plan.settings.period);
  const auto plays =
      plays_of(declared.rig, loads, arm::arm_record(records, declared.rig, "simulated"), warnings);
  for (std::size_t j = 0; j < 5; ++j) {
    const diagnosis::Estimate& e = plays[j].estimate;
    const double truth = declared.joints[j].gear->backlash;
    EXPECT_EQ(e.status, truth > 0 ? diagnosis::Status::ok : diagnosis::Status::below_range) << e.message;
    EXPECT_LE(e.angle_lower, truth) << plays[j].joint;
    EXPECT_GE(e.angle_upper, truth) << plays[j].joint;
  }
  EXPECT_NE(plays[5].estimate.message.find("cannot tell"), std::string::npos);
}

}  // namespace
}  // namespace backlash::geared_arm
