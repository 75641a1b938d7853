// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/report/script.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "backlash_diagnosis/base/error.h"

namespace backlash::report {
namespace {

namespace fs = std::filesystem;

const std::string kPython = "/usr/bin/python3";  // Debian's, which has matplotlib and the ROS modules

/// Exit code of a program; throws Error where it does not even start.
int run(std::vector<std::string> words) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int problem = ::posix_spawn(&child, words[0].c_str(), nullptr, nullptr, arguments.data(), environ);
  if (problem != 0) throw Error("cannot start " + words[0] + ": " + std::strerror(problem));
  int status = 0;
  while (::waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throw Error("cannot wait for " + words[0] + ": " + std::strerror(errno));
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

int run_script(const std::string& name, const std::vector<std::string>& arguments) {
  std::error_code error;
  const fs::path script = fs::read_symlink("/proc/self/exe", error).parent_path() / name;
  if (error || !fs::exists(script)) throw Error("cannot run " + script.string() + ": it is missing");
  std::vector<std::string> words = {kPython, script.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return run(std::move(words));
}

}  // namespace backlash::report
