// SPDX-License-Identifier: BSD-3-Clause
// Bytes as a stream of joint states, converted and kept as the diagnoser does it.
#include <fuzzer/FuzzedDataProvider.h>

#include <cmath>

#include "backlash_diagnosis/diagnosis/sample_stream.h"
#include "backlash_diagnosis/ros/joint_state.h"
#include "fuzz.h"

using namespace backlash;

namespace {

const std::vector<std::string> kNames = {
    "joint_motor",         "joint_sensor", "joint_load", "joint_reference", "joint_current",
    "joint_accelerometer", "elbow_motor",  "",           "joint",           "elbow_load"};

std::vector<double> values_from(FuzzedDataProvider& in, std::size_t usual) {
  const std::size_t size = in.ConsumeBool() ? usual : in.ConsumeIntegralInRange<std::size_t>(0, 12);
  std::vector<double> values(size);
  for (double& value : values)
    value = in.ConsumeBool() ? in.ConsumeProbability<double>() : in.ConsumeFloatingPoint<double>();
  if (in.ConsumeIntegralInRange(0, 7) == 0 && size > 0)
    values[in.ConsumeIntegralInRange<std::size_t>(0, size - 1)] = in.ConsumeBool() ? NAN : INFINITY;
  return values;
}

sensor_msgs::JointState message_from(FuzzedDataProvider& in, ros::Time& stamp) {
  sensor_msgs::JointState m;
  if (in.ConsumeIntegralInRange(0, 15) == 0)
    stamp = ros::Time(in.ConsumeIntegral<std::uint32_t>(),
                      in.ConsumeIntegralInRange<std::uint32_t>(0, 999'999'999));
  else if (stamp.sec < 4'000'000'000u)
    stamp += ros::Duration(0, 1'000'000);
  m.header.stamp = stamp;
  const std::size_t names = in.ConsumeIntegralInRange<std::size_t>(0, 8);
  for (std::size_t i = 0; i < names; ++i)
    m.name.push_back(in.ConsumeIntegralInRange(0, 15) == 0 ? in.ConsumeRandomLengthString(40)
                     : in.PickValueInArray({0, 1, 2, 3, 4, 5, 6, 7, 8, 9}) < 5 && i < 3
                         ? kNames[i]
                         : kNames[in.ConsumeIntegralInRange<std::size_t>(0, kNames.size() - 1)]);
  m.position = values_from(in, names);
  m.velocity = values_from(in, names);
  m.effort = values_from(in, names);
  return m;
}

void check_stream(const diagnosis::SampleStream& stream, long offered) {
  const diagnosis::StreamCounters& c = stream.counters();
  fuzz::require(c.accepted + c.not_a_number + c.repeated == offered, "samples that no counter knows");
  const record::Record& kept = stream.kept();
  for (std::size_t i = 0; i < kept.size(); ++i)
    fuzz::require(i == 0 || kept.time[i] > kept.time[i - 1], "times that do not increase");
  for (const record::Channel channel : record::kChannels)
    for (const double value : kept.column(channel))
      fuzz::require(std::isfinite(value), "a value that is not finite");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider in(data, size);
  ros_bridge::JointStateReader reader({record::usual_channels("joint"), record::usual_channels("elbow")});
  diagnosis::StreamSettings settings;
  settings.keep = 0.5;
  diagnosis::ApdSettings apd;
  apd.signal = record::Channel::sensor_torque;
  apd.period = 0.01;
  apd.layout = {20, -1.0, 1.0};
  if (in.ConsumeBool()) settings.apd = apd;
  diagnosis::SampleStream streams[] = {diagnosis::SampleStream(settings), diagnosis::SampleStream(settings)};
  ros_bridge::StampClock clock;
  ros::Time stamp(1'000'000'000, 0);
  long offered[2] = {0, 0};
  while (in.remaining_bytes() > 0) {
    const sensor_msgs::JointState message = message_from(in, stamp);
    for (const std::size_t joint : reader.read(message)) {
      fuzz::require(joint < 2, "a joint that nobody asked for");
      if (!reader.problem(joint).empty()) continue;
      for (const double value : reader.values(joint)) fuzz::require(!std::isinf(value), "an infinite value");
      ++offered[joint];
      streams[joint].add(clock.seconds(message.header.stamp), reader.values(joint));
    }
  }
  for (int joint = 0; joint < 2; ++joint) {
    check_stream(streams[joint], offered[joint]);
    (void)streams[joint].latest(0);
  }
  return 0;
}
