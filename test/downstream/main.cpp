// SPDX-License-Identifier: BSD-3-Clause
// Simulates a rig, estimates its backlash and puts the answers into messages. Exit code 0 where at least two
// estimators answer and every answer's interval holds the backlash that was simulated. Usage:
// backlash_downstream RIG.yaml
#include <iostream>

#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/ros/messages.h"

int main(int argc, char** argv) {
  if (argc != 2) return 64;
  backlash::rig_file::RigFile file = backlash::rig_file::load_rig_file(argv[1]);
  const double truth = file.rig.mesh.backlash = 80e-6;  // m
  file.simulation.sensors.sampling_rate = 5000;         // Hz
  const backlash::record::Record record =
      backlash::simulation::simulate_record(file.rig, file.simulation, 2.0);
  const backlash::diagnosis::Diagnosis diagnosis =
      backlash::diagnosis::diagnose(record, file.diagnosis, nullptr);

  int answers = 0, right = 0;
  for (const backlash::diagnosis::Estimate& estimate : diagnosis.estimates) {
    const backlash_diagnosis::BacklashEstimate message = backlash::ros_bridge::to_message(estimate);
    std::cout << message.method << ": " << message.status_name << ", " << message.lower << " to "
              << message.upper << " m of " << truth << " m\n";
    if (message.status != backlash_diagnosis::BacklashEstimate::OK) continue;
    ++answers;
    if (message.lower <= truth && truth <= message.upper) ++right;
  }
  return answers >= 2 && right == answers ? 0 : 1;
}
