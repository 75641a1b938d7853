// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/csv.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <istream>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/time_base.h"
#include "backlash_diagnosis/record/unit.h"
#include "csv_lines.h"
#include "csv_time.h"
#include "mapped_csv.h"

namespace backlash::record {
namespace {

constexpr char kSeparator = ',';

std::vector<std::string> required_names() {
  std::vector<std::string> names;
  for (const Channel channel : kBacklashChannels) names.push_back(channel_name(channel));
  return names;
}

bool has_required_channel(const std::vector<Channel>& channels) {
  return std::any_of(channels.begin(), channels.end(), [](Channel channel) {
    return std::find(kBacklashChannels.begin(), kBacklashChannels.end(), channel) != kBacklashChannels.end();
  });
}

class Reader {
 public:
  Reader(std::istream& in, const std::string& name, bool linear)
      : lines_(in, name), name_(name), linear_(linear) {}

  std::vector<JointRecord> read() {
    read_header();
    each_row(lines_, [this](std::string_view line) { read_row(line); });
    if (rows_.times.empty()) throw BadData(name_, "no data: there are only column names");
    joints_.front().record.warnings = rows_.warnings();
    for (JointRecord& joint : joints_) {
      joint.record.time = rows_.times;
      rows_.stamps().count_into(joint.record);
      if (clock_) joint.record.origin = clock_->origin();
    }
    return {std::make_move_iterator(joints_.begin()), std::make_move_iterator(joints_.end())};
  }

 private:
  void read_header() {
    std::string_view line;
    if (!lines_.next(line)) throw BadData(name_ + ":1", "empty, expected column names");
    if (trimmed(line).empty()) lines_.fail("an empty line, expected column names");
    split(line, kSeparator, fields_);
    refuse_other_separator();
    for (const std::string_view field : fields_) add_column(std::string(field));
    if (time_column_ == kNone) lines_.fail("no column 'time'; there are: " + joined(names_));
    for (const JointRecord& joint : joints_) check_channels(joint);
    if (joints_.empty()) check_channels({});
  }

  void check_channels(const JointRecord& joint) const {
    if (!has_required_channel(channels_.count(joint.joint) ? channels_.at(joint.joint)
                                                           : std::vector<Channel>())) {
      lines_.fail((joint.joint.empty() ? "" : "joint " + in_quotes(joint.joint) + ": ") +
                  "no torque, position, speed of the motor, current or acceleration: needs at least one of " +
                  joined(required_names()) + "; there are: " + joined(names_));
    }
  }

  void add_column(const std::string& text) {
    if (text.empty()) lines_.fail("column " + std::to_string(names_.size() + 1) + " has no name");
    const Label label = label_of(text);
    const std::string name(label.name);
    if (!is_own_column(name) || name.front() == '/') fail_unknown_column(text);
    if (std::find(bare_names_.begin(), bare_names_.end(), name) != bare_names_.end()) {
      lines_.fail("column = " + in_quotes(text) + ": there twice");
    }
    const Unit* const unit = label.has_unit ? find_unit(label.unit) : nullptr;
    if (label.has_unit && unit == nullptr) fail_unit(text, label, "unknown, known are " + known_units());
    if (name == kTimeColumn) {
      if (unit != nullptr && unit->quantity != Quantity::time) fail_unit(text, label, "is no time");
      if (unit != nullptr) clock_.emplace(*unit);
      time_column_ = names_.size();
      targets_.push_back(nullptr);
    } else {
      add_channel(name, text, label, unit);
    }
    units_.push_back(unit);
    bare_names_.push_back(name);
    names_.push_back(text);
  }

  void add_channel(const std::string& name, const std::string& text, const Label& label, const Unit* unit) {
    const auto slash = name.rfind('/');
    const std::string joint = slash == std::string::npos ? "" : name.substr(0, slash);
    const Channel channel = channel_from_name(name.substr(slash + 1));
    if (unit != nullptr)
      if (const std::string reason = misfit(*unit, channel, linear_, false); !reason.empty())
        fail_unit(text, label, reason);
    channels_[joint].push_back(channel);
    targets_.push_back(&record_of(joint).column(channel));
  }

  [[noreturn]] void fail_unit(const std::string& column, const Label& label,
                              const std::string& reason) const {
    lines_.fail(printable(column) + ": unit = " + in_quotes(label.unit) + ": " + reason);
  }

  Record& record_of(const std::string& joint) {
    const auto known =
        std::find_if(joints_.begin(), joints_.end(), [&](const JointRecord& j) { return j.joint == joint; });
    if (known != joints_.end()) return known->record;
    if (!joints_.empty() && (joint.empty() || joints_.front().joint.empty()))
      lines_.fail("some columns name their joint and some do not: all or none must (JOINT/channel)");
    joints_.push_back({joint, {}});
    joints_.back().record.name = name_;
    return joints_.back().record;
  }

  [[noreturn]] void fail_unknown_column(const std::string& name) const {
    std::string known = kTimeColumn;
    for (const Channel channel : kChannels) known += ", " + channel_name(channel);
    lines_.fail("column = " + in_quotes(name) + ": unknown, known are " + known +
                "; a file with names of its own, or none, is read by `channels` of a rig file (--rig)");
  }

  // A tab beside a field is a space; one within it separates.
  void refuse_other_separator() const {
    for (const std::string_view field : fields_) {
      const auto place = field.find_first_of(";\t");
      if (place == std::string_view::npos) continue;
      lines_.fail(std::string("separator is '") + (field[place] == ';' ? ";" : "\\t") + "', expected ','");
    }
  }

  void read_row(std::string_view line) {
    split(line, kSeparator, fields_);
    if (fields_.size() != names_.size()) {
      refuse_other_separator();
      lines_.fail(std::to_string(fields_.size()) + (fields_.size() == 1 ? " field" : " fields") + " in " +
                  in_quotes(line) + ", expected " + std::to_string(names_.size()) + ": " + joined(names_));
    }
    values_.resize(fields_.size());
    for (std::size_t i = 0; i < fields_.size(); ++i) values_[i] = read_field(i);
    if (!rows_.accept(values_[time_column_], names_[time_column_], fields_[time_column_], lines_)) return;
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      if (i != time_column_) targets_[i]->push_back(values_[i]);
    }
  }

  double read_field(std::size_t i) {
    const bool of_clock = clock_ && i == time_column_;
    if (i != time_column_ && is_no_number(fields_[i])) return std::numeric_limits<double>::quiet_NaN();
    const ParsedNumber number = of_clock ? clock_->read(fields_[i]) : parse_number(fields_[i]);
    if (!number)
      lines_.fail(printable(names_[i]) + " = " + in_quotes(fields_[i]) + ": " +
                  (fields_[i].empty() ? "empty" : number.problem));
    return of_clock || units_[i] == nullptr ? number.value : units_[i]->si(number.value);
  }

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  LineReader lines_;
  const std::string name_;
  std::deque<JointRecord> joints_;  // targets_ point into them
  const bool linear_;
  RowTimes rows_;
  std::optional<StampReader> clock_;             // where the time has a unit
  std::vector<std::string> names_, bare_names_;  // with and without unit
  std::vector<const Unit*> units_;
  std::map<std::string, std::vector<Channel>> channels_;  // of each joint
  std::vector<std::vector<double>*> targets_;             // one per column, nullptr for time
  std::size_t time_column_ = kNone;
  std::vector<std::string_view> fields_;
  std::vector<double> values_;
};

std::vector<Channel> present_channels(const Record& record) {
  std::vector<Channel> present;
  for (const Channel channel : kChannels) {
    if (record.has(channel)) present.push_back(channel);
  }
  return present;
}

void check_writable(const Record& record, const std::vector<Channel>& channels) {
  if (record.time.empty()) throw BadData(record.name, "a record without samples cannot be written");
  if (!has_required_channel(channels)) {
    throw BadData(record.name,
                  "a record needs at least one of " + joined(required_names()) + " to be written");
  }
  for (const Channel channel : channels) {
    const std::vector<double>& column = record.column(channel);
    if (column.size() != record.size()) {
      throw BadData(record.name, channel_name(channel) + " has " + std::to_string(column.size()) +
                                     " values, time has " + std::to_string(record.size()));
    }
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (std::isfinite(column[i])) continue;
      throw BadData(record.name, channel_name(channel) + " = " + to_text(column[i]) + " in sample " +
                                     std::to_string(i) + ": not a finite number");
    }
  }
}

// The stamps as they will be read back, which must still increase.
std::vector<std::string> stamp_texts(const Record& record) {
  std::vector<std::string> texts(record.size());
  StampChecker stamps;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const auto fail = [&](const char* reason) {
      throw BadData(record.name, "time = " + to_text(record.time[i]) + " s in sample " + std::to_string(i) +
                                     ": " + reason);
    };
    if (!std::isfinite(record.time[i])) fail("not a finite number");
    texts[i] = time_text(record.time[i]);
    if (stamps.next(parse_number(texts[i]).value) != StampVerdict::accept) {
      fail("does not increase by at least 1 ns");
    }
  }
  return texts;
}

}  // namespace

Record read_csv(const std::string& path) {
  std::ifstream in = open_input(path);
  return read_csv(in, path);
}

Record read_csv(std::istream& in, const std::string& name) {
  return record_of_joint(read_joints_csv(in, name), "", name);
}

Record read_csv(const std::string& path, const ChannelMap& map, const std::string& joint) {
  std::ifstream in = open_input(path);
  return read_csv(in, path, map, joint);
}

Record read_csv(std::istream& in, const std::string& name, const ChannelMap& map, const std::string& joint) {
  if (!map.columns.empty()) {
    MappedCsv mapped(in, name, map);
    if (mapped.find_header()) return mapped.read();
    if (!mapped.first_line_is_own()) mapped.refuse();
    in.clear();
    if (!in.seekg(0))
      throw BadData(name, "is no file, which is needed to read it by channels of the rig file");
  }
  return record_of_joint(read_joints_csv(in, name, map.linear), joint, name);
}

std::vector<JointRecord> read_joints_csv(const std::string& path, bool linear) {
  std::ifstream in = open_input(path);
  return read_joints_csv(in, path, linear);
}

std::vector<JointRecord> read_joints_csv(std::istream& in, const std::string& name, bool linear) {
  return Reader(in, name, linear).read();
}

Record record_of_joint(std::vector<JointRecord> joints, const std::string& joint, const std::string& name) {
  if (joints.size() == 1 && (joints.front().joint.empty() || joint.empty()))
    return std::move(joints.front().record);
  std::vector<std::string> names;
  for (JointRecord& j : joints) {
    names.push_back(j.joint);
    if (j.joint != joint || joint.empty()) continue;
    j.record.warnings.insert(j.record.warnings.begin(), joints.front().record.warnings.begin(),
                             &j == &joints.front() ? joints.front().record.warnings.begin()
                                                   : joints.front().record.warnings.end());
    return std::move(j.record);
  }
  throw BadData(name, "several joints: " + joined(names) +
                          (joint.empty() ? "; the command looks at one, which the rig file names (joint:)"
                                         : "; the rig file asks for joint " + in_quotes(joint)));
}

void write_csv(const Record& record, const std::string& path) {
  write_joints_csv({{"", record}}, path);
}

void write_joints_csv(const std::vector<JointRecord>& joints, const std::string& path) {
  if (joints.empty()) throw BadData(path, "a record without joints cannot be written");
  const Record& first = joints.front().record;
  std::string content = kTimeColumn;
  std::vector<const std::vector<double>*> columns;
  for (const JointRecord& joint : joints) {
    const std::vector<Channel> channels = present_channels(joint.record);
    check_writable(joint.record, channels);
    if (joint.record.time != first.time)
      throw BadData(path, joint.joint + ": has other times than the first joint");
    for (const Channel channel : channels) {
      content += kSeparator + (joint.joint.empty() ? "" : joint.joint + "/") + channel_name(channel);
      columns.push_back(&joint.record.column(channel));
    }
  }
  const std::vector<std::string> stamps = stamp_texts(first);
  content += '\n';
  for (std::size_t i = 0; i < first.size(); ++i) {
    content += stamps[i];
    for (const std::vector<double>* column : columns) {
      content += kSeparator;
      content += to_text((*column)[i]);
    }
    content += '\n';
  }
  write_file(path, content);
}

}  // namespace backlash::record
