// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/recording/recording.h"

#include <algorithm>
#include <filesystem>

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

/// A folder of rosbag2: its files one after the other.
class Folder : public Recording {
 public:
  explicit Folder(const std::string& path) {
    const YamlReader yaml = YamlReader::from_file((fs::path(path) / kMetadata).string());
    const YamlReader info = yaml.map("rosbag2_bagfile_information");
    for (const std::string& name : info.texts("relative_file_paths")) {
      // rosbag2 before 2020 wrote the folder's own name in front.
      fs::path file = fs::path(path) / name;
      std::error_code error;
      if (!fs::exists(file, error)) file = fs::path(path) / fs::path(name).filename();
      const auto extension = file.extension();
      if (extension != ".mcap" && extension != ".db3")
        info.fail(
            "relative_file_paths",
            "'" + printable(name) + "': expected .mcap or .db3; unpack compressed files first (zstd -d)");
      files_.push_back(open_file(file.string()));
    }
    if (files_.empty()) info.fail("relative_file_paths", "names no file");
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
    for (const auto& file : files_) file->read(topics, take);
  }

  std::vector<std::string> warnings() const override {
    std::vector<std::string> all;
    for (const auto& file : files_)
      for (std::string& warning : file->warnings()) all.push_back(std::move(warning));
    return all;
  }

 private:
  std::vector<std::unique_ptr<Recording>> files_;
};

}  // namespace

bool is_recording(const std::string& path) {
  const fs::path file(path);
  std::error_code error;
  if (fs::is_directory(file, error)) return fs::exists(file / kMetadata, error);
  return file.extension() == ".mcap" || file.extension() == ".db3";
}

std::unique_ptr<Recording> open_recording(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return std::make_unique<Folder>(path);
  return open_file(path);
}

}  // namespace backlash::recording
