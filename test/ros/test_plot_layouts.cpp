// SPDX-License-Identifier: BSD-3-Clause
// What config/plotjuggler.xml and doc/plots.md make plotting programs show is what the nodes publish: each
// name is looked up in the definitions of the messages, as these programs do.
#include <backlash_diagnosis/AmplitudeDistribution.h>
#include <backlash_diagnosis/BacklashEstimate.h>
#include <gtest/gtest.h>
#include <sensor_msgs/JointState.h>

#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "backlash_diagnosis/rig_file/rig_file.h"
#include "backlash_diagnosis/ros/joint_state.h"
#include "support/data.h"

namespace backlash::ros_bridge {
namespace {

using Fields = std::map<std::string, std::string>;  // name -> type
using Tree = boost::property_tree::ptree;

template <typename Message>
Fields fields_of() {
  Fields fields;
  std::istringstream definition(ros::message_traits::Definition<Message>::value());
  const std::regex field(R"(^\s*([\w/]+(?:\[\])?)\s+(\w+)\s*(?:#.*)?$)");
  for (std::string line; std::getline(definition, line) && line.rfind("====", 0) != 0;) {
    std::smatch found;
    if (std::regex_match(line, found, field)) fields[found[2]] = found[1];
  }
  return fields;
}

/// Topics of the nodes under their own names.
const std::map<std::string, Fields>& topics() {
  static const std::map<std::string, Fields> all = {
      {"joint_states", fields_of<sensor_msgs::JointState>()},
      {"backlash_estimate", fields_of<backlash_diagnosis::BacklashEstimate>()},
      {"amplitude_distribution", fields_of<backlash_diagnosis::AmplitudeDistribution>()}};
  return all;
}

std::string type_of(const std::string& topic, const std::string& field) {
  const auto fields = topics().find(topic);
  if (fields == topics().end()) return "no topic";
  const auto type = fields->second.find(field);
  return type == fields->second.end() ? "no field" : type->second;
}

/// PlotJuggler names /TOPIC/FIELD, and of a JointState /TOPIC/NAME/FIELD.
void expect_series(const std::string& series) {
  std::smatch found;
  if (std::regex_match(series, found, std::regex("/joint_states/(\\w+)/(\\w+)"))) {
    const JointNames names(rig_file::default_rig_file().rig.joint);
    EXPECT_TRUE((std::set<std::string>{names.motor, names.sensor, names.load}.count(found[1]))) << series;
    EXPECT_EQ(type_of("joint_states", found[2]), "float64[]") << series;
  } else {
    ASSERT_TRUE(std::regex_match(series, found, std::regex("/(\\w+)/(\\w+)"))) << series;
    EXPECT_EQ(type_of(found[1], found[2]), "float64") << series;
  }
}

/// All elements of this name, anywhere.
void find_all(const Tree& tree, const std::string& name, std::vector<Tree>& found) {
  for (const auto& [key, child] : tree) {
    if (key == name) found.push_back(child);
    find_all(child, name, found);
  }
}

TEST(PlotLayouts, PlotJugglerShowsWhatIsPublished) {
  Tree tree;
  boost::property_tree::read_xml(test::package_file("config/plotjuggler.xml"), tree);
  std::vector<Tree> curves, splitters;
  find_all(tree.get_child("root"), "curve", curves);
  std::set<std::string> shown;
  for (const Tree& curve : curves) {
    const bool over_another = curve.count("<xmlattr>") && curve.get_child("<xmlattr>").count("curve_x");
    for (const std::string& key :
         over_another ? std::vector<std::string>{"curve_x", "curve_y"} : std::vector<std::string>{"name"}) {
      shown.insert(curve.get<std::string>("<xmlattr>." + key));
      expect_series(*shown.find(curve.get<std::string>("<xmlattr>." + key)));
    }
  }
  for (const char* series : {"/backlash_estimate/backlash", "/backlash_estimate/lower",
                             "/backlash_estimate/upper", "/amplitude_distribution/skewness",
                             "/joint_states/joint_motor/position", "/joint_states/joint_sensor/effort"})
    EXPECT_EQ(shown.count(series), 1u) << series;
  // As many parts and sizes as a splitter counts, or PlotJuggler reads beyond its list.
  find_all(tree.get_child("root"), "DockSplitter", splitters);
  EXPECT_FALSE(splitters.empty());
  for (const Tree& splitter : splitters) {
    const std::string sizes = splitter.get<std::string>("<xmlattr>.sizes");
    const long count = splitter.get<long>("<xmlattr>.count");
    EXPECT_EQ(std::count(sizes.begin(), sizes.end(), ';') + 1, count);
    EXPECT_EQ(long(splitter.count("DockArea") + splitter.count("DockSplitter")), count);
  }
}

TEST(PlotLayouts, RqtPlotIsGivenWhatIsPublished) {
  std::ifstream page(test::package_file("doc/plots.md"));
  int fields = 0;
  for (std::string line; std::getline(page, line);) {
    std::smatch found;
    if (!std::regex_match(line, found, std::regex("    rqt_plot /(\\w+)/(.+)"))) continue;
    const std::string topic = found[1];
    std::istringstream words(found[2]);
    for (std::string field; std::getline(words, field, ':'); ++fields) {
      const std::size_t bracket = field.find('[');
      EXPECT_EQ(type_of(topic, field.substr(0, bracket)),
                bracket == std::string::npos ? "float64" : "float64[]")
          << line;
    }
  }
  EXPECT_GE(fields, 8);
}

}  // namespace
}  // namespace backlash::ros_bridge
