// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/recording/recording.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <vector>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/base/yaml_reader.h"
#include "open_file.h"

namespace backlash::recording {
namespace {

namespace fs = std::filesystem;

const std::string kMetadata = "metadata.yaml";

std::unique_ptr<Recording> open_file(const std::string& path) {
  return fs::path(path).extension() == ".mcap" ? open_mcap(path) : open_sqlite(path);
}

bool is_file_of_recording(const fs::path& file) {
  return file.extension() == ".mcap" || file.extension() == ".db3";
}

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (is_file_of_recording(entry.path())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// Those that metadata.yaml names. Throws BadData, MissingInput.
std::vector<fs::path> files_of_metadata(const fs::path& folder) {
  const YamlReader yaml = YamlReader::from_file((folder / kMetadata).string());
  const YamlReader info = yaml.map("rosbag2_bagfile_information");
  std::vector<fs::path> files;
  for (const std::string& name : info.texts("relative_file_paths")) {
    // rosbag2 before 2020 wrote the folder's own name in front.
    fs::path file = folder / name;
    std::error_code error;
    if (!fs::exists(file, error)) file = folder / fs::path(name).filename();
    if (!is_file_of_recording(file))
      info.fail("relative_file_paths",
                "'" + printable(name) + "': expected .mcap or .db3; unpack compressed files first (zstd -d)");
    if (!fs::exists(file, error))
      info.fail("relative_file_paths", "'" + printable(name) + "' is not in the folder");
    files.push_back(file);
  }
  if (files.empty()) info.fail("relative_file_paths", "names no file");
  return files;
}

/// A folder of rosbag2: its files by their times, which neither names nor metadata need state.
class Folder : public Recording {
 public:
  explicit Folder(const std::string& path) {
    std::vector<fs::path> files;
    try {
      files = files_of_metadata(path);
    } catch (const Error& error) {
      files = files_in(path);
      if (files.empty()) throw;
      missing_ = std::string(error.what()) + "; all files of the folder were read";
    }
    for (const fs::path& file : files) try {
        files_.push_back(open_file(file.string()));
      } catch (const BadData& error) {
        damaged_.push_back(std::string(error.what()) + "; this file was not read");
      }
    if (files_.empty()) throw BadData(path, damaged_.front());
    if (!missing_.empty()) damaged_.insert(damaged_.begin(), missing_);
  }

  std::vector<Topic> topics() override {
    std::vector<Topic> all;
    for (const auto& file : files_)
      for (const Topic& topic : file->topics()) {
        const auto same = [&topic](const Topic& other) {
          return other.name == topic.name && other.type == topic.type && other.encoding == topic.encoding;
        };
        if (std::none_of(all.begin(), all.end(), same)) all.push_back(topic);
      }
    return all;
  }

  void read(const std::vector<std::string>& topics, const Take& take) override {
    if (files_.size() == 1) return files_.front()->read(topics, take);
    std::vector<Extent> extents;
    for (const auto& file : files_) extents.push_back(extent_of(*file, topics));
    std::sort(extents.begin(), extents.end(),
              [](const Extent& a, const Extent& b) { return a.first < b.first; });
    for (std::size_t i = 0; i < extents.size();) {
      std::uint64_t last = extents[i].last;
      std::size_t end = i + 1;
      for (; end < extents.size() && extents[end].first < last; ++end)
        last = std::max(last, extents[end].last);
      if (end == i + 1)
        extents[i].file->read(topics, take);
      else
        read_merged({extents.begin() + std::ptrdiff_t(i), extents.begin() + std::ptrdiff_t(end)}, topics,
                    take);
      i = end;
    }
  }

  std::vector<std::string> warnings() const override {
    std::vector<std::string> all = damaged_;
    for (const auto& file : files_)
      for (std::string& warning : file->warnings()) all.push_back(std::move(warning));
    return all;
  }

 private:
  /// Of the messages of a file.
  struct Extent {
    Recording* file;
    std::uint64_t first, last;  // ns
  };
  struct Kept {
    std::string topic;
    std::uint64_t time;
    std::vector<std::uint8_t> data;
  };

  static Extent extent_of(Recording& file, const std::vector<std::string>& topics) {
    Extent extent{&file, std::numeric_limits<std::uint64_t>::max(), 0};
    file.read(topics, [&extent](const Message& m) {
      extent.first = std::min(extent.first, m.time);
      extent.last = std::max(extent.last, m.time);
    });
    return extent;
  }

  /// Of files whose times overlap.
  static void read_merged(const std::vector<Extent>& files, const std::vector<std::string>& topics,
                          const Take& take) {
    std::vector<Kept> all;
    for (const Extent& each : files)
      each.file->read(topics, [&all](const Message& m) {
        all.push_back({m.topic, m.time, {m.data, m.data + m.size}});
      });
    std::stable_sort(all.begin(), all.end(), [](const Kept& a, const Kept& b) { return a.time < b.time; });
    for (const Kept& m : all) take({m.topic, m.time, m.data.data(), m.data.size()});
  }

  std::vector<std::unique_ptr<Recording>> files_;
  std::string missing_;
  std::vector<std::string> damaged_;  // what was not read, and why
};

}  // namespace

bool is_recording(const std::string& path) {
  const fs::path file(path);
  std::error_code error;
  if (fs::is_directory(file, error)) return fs::exists(file / kMetadata, error) || !files_in(file).empty();
  return is_file_of_recording(file);
}

std::unique_ptr<Recording> open_recording(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return std::make_unique<Folder>(path);
  return open_file(path);
}

}  // namespace backlash::recording
