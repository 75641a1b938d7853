// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/yaml_problems.h"

#include <algorithm>

#include "backlash_diagnosis/base/error.h"

namespace backlash {
namespace {

thread_local YamlProblems* newest = nullptr;

}  // namespace

YamlProblems::YamlProblems() : before_(newest) {
  newest = this;
}

YamlProblems::~YamlProblems() {
  newest = before_;
}

YamlProblems* YamlProblems::current() {
  return newest;
}

void YamlProblems::note(const std::string& text) {
  if (std::find(texts_.begin(), texts_.end(), text) == texts_.end()) texts_.push_back(text);
}

void YamlProblems::reading(const std::function<void()>& part) {
  const std::size_t noted = texts_.size();
  try {
    part();
  } catch (const BadData& error) {
    if (texts_.size() == noted) note(error.what());
  } catch (const InvalidParameter& error) {
    if (texts_.empty()) throw;
  }
}

void YamlProblems::raise(const std::string& source) const {
  if (texts_.empty()) return;
  if (texts_.size() == 1) {
    const std::size_t end = texts_.front().find(": ");
    throw BadData(texts_.front().substr(0, end), texts_.front().substr(end + 2));
  }
  std::string all = std::to_string(texts_.size()) + " mistakes";
  for (const std::string& text : texts_) all += "\n  " + text;
  throw BadData(source, all);
}

}  // namespace backlash
