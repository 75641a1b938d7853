// SPDX-License-Identifier: BSD-3-Clause
// Libraries of this package that are loaded where they are needed: what few machines need is neither linked
// to nor compiled for all that the others run.
#pragma once

#include <string>

namespace backlash {

/// Address of an extern "C" function of a library beside that of this room. `library` is the name of its
/// CMake target. It stays loaded. Throws MissingInput where it is not built or not installed.
void* address_of(const std::string& library, const std::string& function);

/// The same with the function's type, which nobody checks: who declares it and who defines it include one
/// header.
template <typename Function>
Function* loaded_function(const std::string& library, const std::string& function) {
  return reinterpret_cast<Function*>(address_of(library, function));
}

}  // namespace backlash
