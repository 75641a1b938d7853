// SPDX-License-Identifier: BSD-3-Clause
// Work that a file asks for: where it cannot be done, the message names the file.
#pragma once

#include <string>

#include "backlash_diagnosis/base/error.h"

namespace backlash::tools {

/// The result of `work`; what it finds wrong with a parameter or with the motion of a machine becomes the
/// BadData of the file that states them. Options of the command are checked before.
template <typename Work>
auto of_file(const std::string& path, const Work& work) {
  try {
    return work();
  } catch (const InvalidParameter& error) {
    throw BadData(path, error.what());
  } catch (const IntegrationError& error) {
    throw BadData(path, std::string("the machine cannot be simulated: ") + error.what());
  }
}

}  // namespace backlash::tools
