// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/base/loaded_function.h"

#include <dlfcn.h>

#include <filesystem>

#include "backlash_diagnosis/base/error.h"

namespace backlash {

void* address_of(const std::string& library, const std::string& function) {
  Dl_info here = {};
  dladdr(reinterpret_cast<void*>(&address_of), &here);
  const std::string path = std::filesystem::path(here.dli_fname).parent_path() / ("lib" + library + ".so");
  void* const loaded = dlopen(path.c_str(), RTLD_NOW);
  void* const address = loaded == nullptr ? nullptr : dlsym(loaded, function.c_str());
  if (address == nullptr)
    throw MissingInput(path + ": cannot be loaded (" + dlerror() + "): build the target " + library +
                       ", or all");
  return address;
}

}  // namespace backlash
