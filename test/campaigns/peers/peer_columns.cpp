// SPDX-License-Identifier: BSD-3-Clause
// The regressor of an arm by the inverse dynamics of MuJoCo or KDL, for the least-squares script peers.py.
//
//   peer_columns mujoco|kdl ROBOT.urdf JOINT... <STATES >COLUMNS
//
// Doubles: of each state q, v, a of all joints; of each state and joint ten columns per link, the torque of a
// point of 1 kg on the link at each of ten places. These span all bodies: torque is linear in the ten
// standard parameters, and those in the masses of the points.
#include <mujoco/mujoco.h>

#include <cstdio>
#include <functional>
#include <iostream>
#include <memory>
#include <stdexcept>

#include "arm/arm_machines.h"

namespace {

using backlash::arm::Chain;
using backlash::arm::Joints;

/// m: so that 1, x, y, z, xx, xy, ... of them are independent
const std::array<Eigen::Vector3d, 10> kPlaces = {{{0, 0, 0},
                                                  {1, 0, 0},
                                                  {-1, 0, 0},
                                                  {0, 1, 0},
                                                  {0, -1, 0},
                                                  {0, 0, 1},
                                                  {0, 0, -1},
                                                  {1, 1, 0},
                                                  {1, 0, 1},
                                                  {0, 1, 1}}};

/// Torque of the column [N m] at a state.
using Column = std::function<Joints(std::size_t link, std::size_t place, const Joints& state)>;

Column mujoco_columns(const std::string& urdf, const Chain& chain) {
  mju_user_warning = [](const char*) {};  // of a body without mass; they would go to standard output
  char error[500] = "";
  const std::shared_ptr<mjModel> model(mj_loadXML(urdf.c_str(), nullptr, error, sizeof error),
                                       mj_deleteModel);
  if (!model) throw std::runtime_error(urdf + ": " + error);
  model->opt.disableflags |= mjDSBL_CONSTRAINT | mjDSBL_CONTACT | mjDSBL_PASSIVE;
  for (int a = 0; a < 3; ++a) model->opt.gravity[a] = chain.gravity[a];
  for (int b = 0; b < model->nbody; ++b) model->body_mass[b] = 0;
  std::fill_n(model->body_inertia, 3 * model->nbody, 0);
  const std::shared_ptr<mjData> data(mj_makeData(model.get()), mj_deleteData);
  std::vector<int> bodies;
  for (const auto& joint : chain.joints)
    bodies.push_back(model->jnt_bodyid[mj_name2id(model.get(), mjOBJ_JOINT, joint.name.c_str())]);
  return [=](std::size_t link, std::size_t place, const Joints& state) {
    const int body = bodies[link], n = int(chain.size());
    model->body_mass[body] = 1;
    for (int a = 0; a < 3; ++a) model->body_ipos[3 * body + a] = kPlaces[place][a];
    std::copy_n(state.data(), n, data->qpos);
    std::copy_n(state.data() + n, n, data->qvel);
    std::copy_n(state.data() + 2 * n, n, data->qacc);
    mj_inverse(model.get(), data.get());
    model->body_mass[body] = 0;
    return Joints(Eigen::Map<const Joints>(data->qfrc_inverse, n));
  };
}

Column kdl_columns(const Chain& chain) {
  struct Solver {
    KDL::Chain chain;
    std::unique_ptr<KDL::ChainIdSolver_RNE> solver;
  };
  const auto solver = [](const Chain& of) {
    const auto out = std::make_shared<Solver>();
    out->chain = backlash::test::to_kdl(of);
    const Eigen::Vector3d& g = of.gravity;
    out->solver = std::make_unique<KDL::ChainIdSolver_RNE>(out->chain, KDL::Vector(g.x(), g.y(), g.z()));
    return out;
  };
  std::vector<std::shared_ptr<Solver>> all;  // the last: without the point
  for (std::size_t c = 0; c < 10 * chain.size(); ++c) {
    Chain with = chain;
    with.links[c / 10] +=
        backlash::arm::parameters_of(backlash::arm::Body{1, kPlaces[c % 10], Eigen::Matrix3d::Zero()});
    all.push_back(solver(with));
  }
  all.push_back(solver(chain));
  return [all, n = unsigned(chain.size())](std::size_t link, std::size_t place, const Joints& state) {
    KDL::JntArray q(n), v(n), a(n), torque(n), without(n);
    q.data = state.head(n), v.data = state.segment(n, n), a.data = state.tail(n);
    const KDL::Wrenches none(all[0]->chain.getNrOfSegments(), KDL::Wrench::Zero());
    all[10 * link + place]->solver->CartToJnt(q, v, a, none, torque);
    all.back()->solver->CartToJnt(q, v, a, none, without);
    return Joints(torque.data - without.data);
  };
}

int run(const std::vector<std::string>& arguments) {
  const std::string &peer = arguments.at(0), &urdf = arguments.at(1);
  const Chain chain = backlash::arm::read_chain(urdf, {arguments.begin() + 2, arguments.end()});
  const Column column = peer == "mujoco" ? mujoco_columns(urdf, chain) : kdl_columns(chain);
  const auto n = Eigen::Index(chain.size());
  Joints state(3 * n);
  while (std::fread(state.data(), sizeof(double), std::size_t(3 * n), stdin) == std::size_t(3 * n)) {
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> columns(n, 10 * n);
    for (Eigen::Index c = 0; c < 10 * n; ++c)
      columns.col(c) = column(std::size_t(c / 10), std::size_t(c % 10), state);
    std::fwrite(columns.data(), sizeof(double), std::size_t(columns.size()), stdout);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::cerr << "peer_columns: " << error.what() << "\nusage: peer_columns mujoco|kdl ROBOT.urdf JOINT...\n";
    return 65;
  }
}
