// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/scratch_folder.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "backlash_diagnosis/base/error.h"

namespace backlash {

namespace fs = std::filesystem;

ScratchFolder::ScratchFolder() {
  std::error_code error;
  const fs::path place = fs::temp_directory_path(error);
  if (error) throw CannotWrite("no folder for temporary files: " + error.message());
  folder_ = (place / "backlash_diagnosis_XXXXXX").string();
  if (::mkdtemp(folder_.data()) == nullptr)
    throw CannotWrite(place.string() + ": no temporary folder can be made: " + std::strerror(errno));
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

}  // namespace backlash
