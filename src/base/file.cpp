// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "backlash_diagnosis/base/error.h"

namespace backlash {
namespace {

[[noreturn]] void fail_writing(const std::string& path, const std::string& reason) {
  throw CannotWrite(path + ": cannot be written: " + reason);
}

// Returns 0 or the errno of what failed. Closing reports late write errors (quota, network file systems).
int write_and_close(int descriptor, std::string_view content, bool to_disk) {
  int error = 0;
  while (!content.empty()) {
    const ssize_t written = ::write(descriptor, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      error = errno;
      break;
    }
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  if (error == 0 && to_disk && ::fsync(descriptor) != 0) error = errno;
  if (::close(descriptor) != 0 && error == 0) error = errno;
  return error;
}

void write_directly(const std::string& path, std::string_view content) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (descriptor < 0) fail_writing(path, std::strerror(errno));
  if (const int error = write_and_close(descriptor, content, false)) fail_writing(path, std::strerror(error));
}

// Opens a file that did not exist before, with the permissions that the umask allows.
int open_new(const std::string& target, std::string& temporary) {
  for (int attempt = 0; attempt < 1000; ++attempt) {
    temporary = target + ".tmp-" + std::to_string(::getpid()) + "-" + std::to_string(attempt);
    const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0 || errno != EEXIST) return descriptor;
  }
  return -1;
}

}  // namespace

std::ifstream open_input(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    throw MissingInput(path + ": is a directory, expected a file");
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw MissingInput(path + ": cannot be opened: " + std::strerror(errno != 0 ? errno : EIO));
  return stream;
}

std::string read_start(const std::string& path, std::size_t most) {
  std::ifstream in = open_input(path);
  std::string text(most, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad()) throw MissingInput(path + ": cannot be read");
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

void write_file(const std::string& path, std::string_view content) {
  if (path.empty()) fail_writing("''", "no file name");
  std::string target = path;
  struct stat existing {};
  const bool exists = ::stat(path.c_str(), &existing) == 0;
  if (exists) {
    if (S_ISDIR(existing.st_mode)) fail_writing(path, "is a directory");
    if (!S_ISREG(existing.st_mode)) return write_directly(path, content);
    std::error_code ignored;
    const auto real = std::filesystem::canonical(path, ignored);
    if (!ignored) target = real.string();
  }
  std::string temporary;
  const int descriptor = open_new(target, temporary);
  if (descriptor < 0) fail_writing(path, std::strerror(errno));
  if (exists) (void)::fchmod(descriptor, existing.st_mode & 07777);  // best effort: keep the permissions
  int error = write_and_close(descriptor, content, true);
  if (error == 0 && ::rename(temporary.c_str(), target.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(temporary.c_str());
    fail_writing(path, std::strerror(error));
  }
}

}  // namespace backlash
