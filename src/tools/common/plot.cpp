#include "tools/common/plot.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/text.h"
#include "tools/common/command_line.h"
#include "tools/common/exit_codes.h"

namespace backlash::tools {
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

/// Runs `name --out OUT -- DATA`; `what` is in the data file, whatever happens to the picture.
void draw(const std::string& name, const std::string& out, const std::string& data, const std::string& what) {
  std::error_code error;
  const fs::path script = fs::read_symlink("/proc/self/exe", error).parent_path() / name;
  if (error || !fs::exists(script)) throw Error("cannot plot: " + script.string() + " is missing");
  const int code = run({kPython, script.string(), "--out", out, "--", data});
  if (code == kCannotWrite) throw CannotWrite(out + ": cannot be written; " + what + " itself is in " + data);
  if (code != kHealthy)
    throw Error(name + " failed (exit code " + std::to_string(code) + "); " + what + " itself is in " + data);
}

}  // namespace

void check_plot_path(const std::string& path) {
  const std::string extension = fs::path(path).extension();
  if (extension != ".png" && extension != ".svg" && extension != ".pdf")
    throw UsageError("'" + printable(path, 4096) + "': a plot must end in .png, .svg or .pdf");
}

void plot_curve(const std::string& curve_path, const std::string& picture_path) {
  draw("plot_curve.py", picture_path, curve_path, "the curve");
}

void plot_integrator_study(const std::string& json_path, const std::string& prefix) {
  draw("plot_integrator_study.py", prefix, json_path, "the study");
}

void plot_uncertainty_study(const std::string& json_path, const std::string& picture_path) {
  draw("plot_uncertainty_study.py", picture_path, json_path, "the study");
}

void plot_identification(const std::string& json_path, const std::string& picture_path) {
  draw("plot_identification.py", picture_path, json_path, "the identification");
}

void plot_model_comparison(const std::string& json_path, const std::string& picture_path) {
  draw("plot_model_comparison.py", picture_path, json_path, "the comparison");
}

void plot_separability_map(const std::string& json_path, const std::string& picture_path) {
  draw("plot_separability_map.py", picture_path, json_path, "the map");
}

}  // namespace backlash::tools
