// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/ros/job.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/scratch_folder.h"
#include "backlash_diagnosis/base/text.h"

namespace backlash::ros_bridge {
namespace {

namespace fs = std::filesystem;
using SteadyClock = std::chrono::steady_clock;

constexpr int kLowestPriority = 19;       // niceness: what nobody else wants of the processors
constexpr int kFirstToBeEnded = 1000;     // oom_score_adj: before all other processes
constexpr int kPoll = 50;                 // ms from one question whether to go on to the next; a choice
constexpr std::size_t kMostWords = 4096;  // bytes of the last words that are kept; a choice
constexpr std::size_t kMostLine = 65536;  // bytes of a line of progress; a choice: no command writes so many
constexpr std::chrono::milliseconds kGrace{500};  // from the request to end to the end; a choice below 1 s
constexpr int kNotStarted = 127;                  // exit code, as that of a shell

/// Both ends of a pipe, closed with it.
struct Pipe {
  int from = -1, to = -1;
  Pipe() {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) throw JobFailed(std::string("no pipe: ") + std::strerror(errno));
    from = ends[0];
    to = ends[1];
    ::fcntl(from, F_SETFL, O_NONBLOCK);
  }
  ~Pipe() {
    close_end(from);
    close_end(to);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  static void close_end(int& end) {
    if (end >= 0) ::close(end);
    end = -1;
  }
};

/// Between fork and exec of a process with threads: only calls that are safe in a signal handler.
[[noreturn]] void become(char* const* words, int out, int err, pid_t parent, rlim_t memory) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(kNotStarted);
  ::setpriority(PRIO_PROCESS, 0, kLowestPriority);
  const rlimit bound{memory, memory};
  ::setrlimit(RLIMIT_DATA, &bound);
  if (const int file = ::open("/proc/self/oom_score_adj", O_WRONLY); file >= 0) {
    static_assert(kFirstToBeEnded == 1000, "as written below");
    [[maybe_unused]] const ssize_t written = ::write(file, "1000", 4);
    ::close(file);
  }
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(err, STDERR_FILENO);
  constexpr unsigned kFirst = STDERR_FILENO + 1;
  if (::syscall(SYS_close_range, kFirst, ~0U, 0) != 0)
    for (int i = kFirst; i < 1024; ++i) ::close(i);  // Linux before 5.9
  ::execv(words[0], words);
  const char* const reason = "cannot be started";
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, reason, std::strlen(reason));
  ::_exit(kNotStarted);
}

/// A running job; ends with this.
class Child {
 public:
  explicit Child(const Job& job) : name_(fs::path(job.words.at(0)).filename()) {
    std::vector<std::string> words = job.words;
    std::vector<char*> arguments(words.size() + 1, nullptr);
    std::transform(words.begin(), words.end(), arguments.begin(),
                   [](std::string& word) { return word.data(); });
    const pid_t parent = ::getpid();
    const auto memory = static_cast<rlim_t>(1e9 * job.memory);
    id_ = ::fork();
    if (id_ == 0) become(arguments.data(), out_.to, err_.to, parent, memory);
    if (id_ < 0) throw JobFailed(name_ + " cannot be started: " + std::strerror(errno));
    ::setpgid(id_, id_);  // here and there: whoever comes first
    Pipe::close_end(out_.to);
    Pipe::close_end(err_.to);
  }
  ~Child() {
    if (status_) return;
    ::kill(-id_, SIGKILL);
    while (::waitpid(id_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Waits a little for news; false once the process has ended and all that it wrote is read.
  bool wait() {
    pollfd ends[] = {{out_.from, POLLIN, 0}, {err_.from, POLLIN, 0}};
    ::poll(ends, 2, kPoll);
    int status = 0;
    const bool ended = ::waitpid(id_, &status, WNOHANG) == id_;
    if (ended) status_ = status;
    read_all(out_, lines_);
    read_all(err_, errors_);
    if (errors_.size() > kMostWords) errors_.erase(0, errors_.size() - kMostWords);
    return !ended;
  }

  /// The next whole line of its standard output.
  std::optional<std::string> line() {
    const std::size_t end = lines_.find('\n');
    if (end == std::string::npos) {
      if (lines_.size() > kMostLine) lines_.clear();
      return std::nullopt;
    }
    std::string first = lines_.substr(0, end);
    lines_.erase(0, end + 1);
    return first;
  }

  /// Asks it to end, then ends it.
  void cancel() {
    ::kill(id_, SIGTERM);
    const auto until = SteadyClock::now() + kGrace;
    while (wait())
      if (SteadyClock::now() > until) return;
  }

  /// Throws JobFailed unless it ended with one of the codes.
  void check(const std::vector<int>& done) const {
    if (WIFSIGNALED(*status_))
      throw JobFailed(fmt::format("{} was ended by signal {} ({})", name_, WTERMSIG(*status_),
                                  ::strsignal(WTERMSIG(*status_))));
    const int code = WEXITSTATUS(*status_);
    if (std::find(done.begin(), done.end(), code) != done.end()) return;
    const std::string words = last_words();
    throw JobFailed(words.empty() ? fmt::format("{} ended with exit code {}", name_, code) : words);
  }

 private:
  static void read_all(Pipe& pipe, std::string& text) {
    char buffer[4096];
    for (;;) {
      const ssize_t count = pipe.from < 0 ? 0 : ::read(pipe.from, buffer, sizeof buffer);
      if (count > 0)
        text.append(buffer, static_cast<std::size_t>(count));
      else if (count < 0 && errno == EINTR)
        continue;
      else {
        if (count == 0) Pipe::close_end(pipe.from);  // poll() passes over it from now on
        return;
      }
    }
  }

  /// Of standard error, without the name of the command.
  std::string last_words() const {
    const std::string_view all =
        trimmed(std::string_view(errors_).substr(0, errors_.find_last_not_of('\n') + 1));
    std::string_view last = all.substr(all.find_last_of('\n') + 1);
    if (last.substr(0, name_.size() + 2) == name_ + ": ") last.remove_prefix(name_.size() + 2);
    return printable(last, kMostWords);
  }

  std::string name_, lines_, errors_;
  Pipe out_, err_;
  pid_t id_ = -1;
  std::optional<int> status_;
};

/// What a job has reported last.
struct JobProgress {
  double fraction = 0;
  std::string phase = "starting", best;

  /// False for a line that is no progress.
  bool read(const std::string& line) {
    const auto json = nlohmann::json::parse(line, nullptr, false);
    if (!json.is_object() || !json.contains("fraction") || !json["fraction"].is_number()) return false;
    fraction = json["fraction"];
    phase = json.value("phase", phase);
    best = json.value("best", best);
    return true;
  }
};

}  // namespace

void run_job(const Job& job) {
  if (!(job.memory > 0)) throw InvalidParameter("memory", job.memory, "must be > 0 GB");
  Child child(job);
  JobProgress reported;
  for (bool running = true; running;) {
    running = child.wait();
    const std::string before = reported.best;
    while (const auto line = child.line()) reported.read(*line);
    if (job.best_so_far && reported.best != before) job.best_so_far(reported.best);
    if (running && job.progress && !job.progress(reported.fraction, reported.phase)) {
      child.cancel();
      throw Cancelled();
    }
  }
  child.check(job.done);
}

std::string command_path(const std::string& name) {
  std::error_code error;
  const fs::path path = fs::read_symlink("/proc/self/exe", error).parent_path() / name;
  if (error || !fs::exists(path)) throw MissingInput(path.string() + ": the command is missing");
  return path;
}

std::string file_of(const rig_file::RigFile& rig, const ScratchFolder& scratch) {
  try {
    if (read_start(rig.source, rig.text.size() + 1) == rig.text) return rig.source;
  } catch (const MissingInput&) {  // built in, or gone since
  }
  const std::string copy = scratch.path("rig.yaml");
  write_file(copy, rig.text);
  return copy;
}

}  // namespace backlash::ros_bridge
