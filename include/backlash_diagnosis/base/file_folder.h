// SPDX-License-Identifier: BSD-3-Clause
// A folder in which callers from outside may name files, and nowhere else.
#pragma once

#include <filesystem>
#include <string>

namespace backlash {

/// Confines paths that come over the network, where nobody knows who asks.
class FileFolder {
 public:
  /// Throws InvalidParameter, naming `name`, for an empty path and one that is no folder.
  FileFolder(const std::string& name, const std::string& path);

  /// The absolute path that `path` means: relative ones start in the folder. Throws InvalidParameter, naming
  /// `parameter`, for an empty one and for one that leads out, be it by ".." or by a symbolic link.
  std::string inside(const std::string& parameter, const std::string& path) const;

  /// Makes the folder where it is missing. Throws CannotWrite.
  void create() const;

  std::string path() const { return path_.string(); }

 private:
  std::string name_;
  std::filesystem::path path_;  // absolute, without links as far as it exists
};

}  // namespace backlash
