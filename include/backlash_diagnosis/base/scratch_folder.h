// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace backlash {

/// A folder for files between this process and a script; goes with everything in it.
class ScratchFolder {
 public:
  ScratchFolder();  ///< throws CannotWrite
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  std::string path(const std::string& name) const { return folder_ + "/" + name; }

 private:
  std::string folder_;
};

}  // namespace backlash
