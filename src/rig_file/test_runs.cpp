// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/rig_file/test_runs.h"

#include <filesystem>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/rig_file/rig_file.h"

namespace backlash::rig_file {
namespace {

TestRun read_run(const YamlReader& yaml, const std::string& name, const model::Rig& rig) {
  TestRun run;
  run.name = name;
  run.duration = yaml.number("duration", Range::positive());
  const YamlReader excitation = yaml.map("excitation");
  run.excitation = simulation::read_excitation(excitation);
  check_excitation(excitation, run.excitation, rig);
  run.without_load = yaml.boolean_or("without_load", false);
  if (run.without_load && run.excitation.at_load)
    yaml.fail("without_load", "leaves nothing for a torque at the load to do");
  return run;
}

std::vector<TestRun> read_runs(const YamlReader& yaml, const model::Rig& rig) {
  const YamlReader map = yaml.map("test_runs");
  std::vector<TestRun> runs;
  for (const std::string& name : map.keys()) runs.push_back(read_run(map.map(name), name, rig));
  return runs;
}

}  // namespace

void check_excitation(const YamlReader& yaml, const simulation::ExcitationSettings& excitation,
                      const model::Rig& rig) {
  if (excitation.at_load && rig.link_locked) yaml.fail("at", "the link is locked");
}

std::vector<TestRun> read_test_runs(const YamlReader& rig_file, const model::Rig& rig) {
  if (!rig_file.has("test_runs")) return {};
  if (!rig_file.is_text("test_runs")) return read_runs(rig_file, rig);
  const std::filesystem::path beside = std::filesystem::path(rig_file.source()).parent_path();
  const YamlReader list = YamlReader::from_file((beside / rig_file.text("test_runs")).string());
  list.integer("schema_version", 1, 1);
  std::vector<TestRun> runs = read_runs(list, rig);
  list.finish();
  return runs;
}

const TestRun& find_test_run(const std::vector<TestRun>& runs, const std::string& name) {
  std::vector<std::string> names;
  for (const TestRun& run : runs) {
    if (run.name == name) return run;
    names.push_back(run.name);
  }
  throw InvalidParameter("run", "'" + printable(name) + "'",
                         runs.empty() ? "the rig file has no test_runs" : "must be one of " + joined(names));
}

void apply_test_run(const TestRun& run, RigFile& file) {
  file.simulation.excitation = run.excitation;
  if (run.without_load) file.rig = model::without_load(file.rig);
}

}  // namespace backlash::rig_file
