// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/diagnosis/history.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/diagnosis/diagnose.h"
#include "backlash_diagnosis/signal/order_statistics.h"
#include "history_line.h"
#include "history_parts.h"

namespace backlash::diagnosis {
namespace {

namespace fs = std::filesystem;

constexpr double kLeastSilence = 600, kSilentSteps = 3;  // s, -: choices, see silent_since()

[[noreturn]] void fail(const std::string& path, const std::string& reason) {
  throw CannotWrite(path + ": cannot be written: " + reason);
}

fs::path folder_of(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

/// A name is on the disk when its folder is.
void sync_folder(const std::string& path) {
  const int folder = ::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) fail(path, std::strerror(errno));
  const int error = ::fsync(folder) != 0 && errno != EINVAL ? errno : 0;  // EINVAL: it has none
  ::close(folder);
  if (error != 0) fail(path, std::strerror(error));
}

std::uintmax_t size_of(int descriptor, const std::string& path) {
  struct stat file {};
  if (::fstat(descriptor, &file) != 0) fail(path, std::strerror(errno));
  return static_cast<std::uintmax_t>(file.st_size);
}

/// The first bytes of the file, as many as there are.
std::string beginning(int descriptor, std::size_t count, const std::string& path) {
  std::string text(count, '\0');
  const ssize_t got = ::pread(descriptor, text.data(), count, 0);
  if (got < 0) fail(path, std::strerror(errno));
  text.resize(static_cast<std::size_t>(got));
  return text;
}

bool ends_within_line(int descriptor, std::uintmax_t size, const std::string& path) {
  char last = 0;
  if (::pread(descriptor, &last, 1, static_cast<off_t>(size) - 1) != 1) fail(path, "its end cannot be read");
  return last != '\n';
}

}  // namespace

std::optional<double> silent_since(const std::vector<HistoryEntry>& entries, double end) {
  if (entries.empty()) return std::nullopt;
  std::vector<double> times, steps;
  times.reserve(entries.size());
  for (const HistoryEntry& entry : entries) times.push_back(entry.time);
  std::sort(times.begin(), times.end());
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  const double usual = steps.empty() ? 0 : signal::median(steps);
  if (end - times.back() <= std::max(kLeastSilence, kSilentSteps * usual)) return std::nullopt;
  return times.back();
}

HistoryEntry history_entry(double time, const Diagnosis& diagnosis, const std::string& rig_digest) {
  const Verdict& verdict = diagnosis.verdict;
  HistoryEntry entry;
  entry.time = time;
  entry.grade = to_string(verdict.grade);
  entry.backlash = verdict.backlash;
  entry.lower = verdict.lower;
  entry.upper = verdict.upper;
  entry.backlash_angle = verdict.backlash_angle;
  entry.angle_lower = verdict.angle_lower;
  entry.angle_upper = verdict.angle_upper;
  for (const Estimate& estimate : diagnosis.estimates)
    if (estimate.method == "apd_skewness") entry.skewness = estimate.skewness;
  for (const int member : verdict.members)
    entry.methods +=
        (entry.methods.empty() ? "" : "+") + diagnosis.estimates.at(static_cast<std::size_t>(member)).method;
  entry.rig_digest = rig_digest;
  return entry;
}

History::History(Settings settings) : settings_(std::move(settings)) {
  if (settings_.path.empty()) fail("''", "no file name");
  std::error_code ignored;  // behind a link is the file whose parts are to stand beside it
  const fs::path real = fs::canonical(settings_.path, ignored);
  if (!ignored) settings_.path = real.string();
  open();
}

History::~History() {
  close();
}

History::History(History&& other) noexcept
    : settings_(std::move(other.settings_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

History& History::operator=(History&& other) noexcept {
  std::swap(settings_, other.settings_);
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

void History::close() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
}

void History::open() {
  const std::string& path = settings_.path;
  // O_NONBLOCK: a pipe of that name is refused below instead of waited for.
  descriptor_ = ::open(path.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
  if (descriptor_ < 0) fail(path, std::strerror(errno));
  try {
    struct stat file {};
    if (::fstat(descriptor_, &file) != 0) fail(path, std::strerror(errno));
    if (!S_ISREG(file.st_mode)) fail(path, "is no regular file");
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0)
      fail(path, errno == EWOULDBLOCK ? "another process writes this history" : std::strerror(errno));
    if (!in_place()) fail(path, "another process rotates this history");
    const std::string header = kHistoryHeader + "\n";
    const std::string begun = beginning(descriptor_, header.size(), path);
    if (header.compare(0, begun.size(), begun) != 0)
      throw BadData(path, "is no history of estimates: it begins with '" + printable(begun) + "'");
    // The first line may have been cut off, too.
    if (begun.size() < header.size())
      write(header.substr(begun.size()));
    else if (ends_within_line(descriptor_, size_of(descriptor_, path), path))
      write("\n");
    sync_folder(path);
  } catch (...) {
    close();
    throw;
  }
}

/// Whether the open file is still the one of that name: someone may have moved it or deleted it.
bool History::in_place() const {
  struct stat ours {
  }, named{};
  return ::fstat(descriptor_, &ours) == 0 && ::stat(settings_.path.c_str(), &named) == 0 &&
         ours.st_ino == named.st_ino && ours.st_dev == named.st_dev;
}

/// All or nothing.
void History::write(const std::string& text) {
  const std::uintmax_t before = size_of(descriptor_, settings_.path);
  int error = 0;
  for (std::size_t done = 0; done < text.size() && error == 0;) {  // a disk that is getting full takes a part
    const ssize_t written = ::write(descriptor_, text.data() + done, text.size() - done);
    if (written >= 0)
      done += static_cast<std::size_t>(written);
    else if (errno != EINTR)
      error = errno;
  }
  if (error == 0 && ::fsync(descriptor_) != 0) error = errno;
  if (error == 0) return;
  // Where even that fails the next opening ends the half line.
  if (::ftruncate(descriptor_, static_cast<off_t>(before)) != 0) close();
  fail(settings_.path, std::strerror(error));
}

/// The lock on the file goes with it: nobody else rotates meanwhile, so that the free number stays free.
void History::rotate() {
  const std::string& path = settings_.path;
  const auto parts = history_parts(path);
  const std::uintmax_t number = parts.empty() ? 1 : parts.back().number + 1;
  if (::rename(path.c_str(), (path + "." + std::to_string(number)).c_str()) != 0)
    fail(path, std::strerror(errno));
  close();
  open();
}

void History::append(const HistoryEntry& entry) {
  const std::string line = to_line(entry) + "\n";
  if (descriptor_ >= 0 && !in_place()) close();
  if (descriptor_ < 0) open();
  const std::uintmax_t size = size_of(descriptor_, settings_.path);
  if (size > kHistoryHeader.size() + 1 && size + line.size() > settings_.rotate_at) rotate();
  write(line);
}

}  // namespace backlash::diagnosis
