// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/file_folder.h"

#include <algorithm>
#include <system_error>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongest = 4096;  // bytes of a path in a message

/// Absolute, with the links of what exists followed and "." and ".." resolved.
fs::path resolved(const fs::path& path, const std::string& name, const std::string& shown) {
  std::error_code error;
  fs::path real = fs::weakly_canonical(fs::absolute(path, error), error);
  if (error) throw InvalidParameter(name, printable(shown, kLongest), error.message());
  return real.has_filename() ? real : real.parent_path();  // without a '/' at its end
}

bool lies_in(const fs::path& path, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

}  // namespace

FileFolder::FileFolder(const std::string& name, const std::string& path) : name_(name) {
  if (path.empty()) throw InvalidParameter(name, "''", "must be a folder");
  path_ = resolved(path, name, path);
  std::error_code ignored;
  if (fs::exists(path_, ignored) && !fs::is_directory(path_, ignored))
    throw InvalidParameter(name, printable(path, kLongest), "is not a folder");
}

std::string FileFolder::inside(const std::string& parameter, const std::string& path) const {
  if (path.empty()) throw InvalidParameter(parameter, "''", "must be a path");
  if (path.find('\0') != std::string::npos)
    throw InvalidParameter(parameter, printable(path, kLongest), "holds a zero byte");
  const fs::path real = resolved(path_ / path, parameter, path);
  // What exists is followed to its end; a link to what does not exist yet is not, and might lead anywhere.
  std::error_code ignored;
  if (!lies_in(real, path_) || fs::is_symlink(fs::symlink_status(real, ignored)))
    throw InvalidParameter(parameter, printable(path, kLongest),
                           "must lie in " + path_.string() + " (" + name_ + ")");
  return real.string();
}

void FileFolder::create() const {
  std::error_code error;
  fs::create_directories(path_, error);
  if (error) throw CannotWrite(path_.string() + ": cannot be made: " + error.message());
}

}  // namespace backlash
