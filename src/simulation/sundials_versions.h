// SPDX-License-Identifier: BSD-3-Clause
// What differs between SUNDIALS 6 and 7: how a context is made, and how the library is kept from printing.
//
// Built and tested with 6.4.1. For 7 every call was compared with the headers of 7.3, and compiled without
// the names that 7 removed; ERKStep's calls, which 7 calls deprecated, are there. It was not built or run
// with 7.
#pragma once

#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <sundials/sundials_context.h>

namespace backlash::simulation::sundials {

// Errors are reported through return codes; the library's own printing would only repeat them.
#if SUNDIALS_VERSION_MAJOR >= 7

inline int create_context(SUNContext* context) {
  const int code = SUNContext_Create(SUN_COMM_NULL, context);
  return code < 0 ? code : SUNContext_ClearErrHandlers(*context);
}
inline int silence_explicit(void* memory) {
  return ERKStepSetMaxHnilWarns(memory, -1);
}
inline int silence_multistep(void* memory) {
  return CVodeSetMaxHnilWarns(memory, -1);
}

#else

inline void silence(int, const char*, const char*, char*, void*) {}
inline int create_context(SUNContext* context) {
  return SUNContext_Create(nullptr, context);
}
inline int silence_explicit(void* memory) {
  return ERKStepSetErrHandlerFn(memory, silence, nullptr);
}
inline int silence_multistep(void* memory) {
  return CVodeSetErrHandlerFn(memory, silence, nullptr);
}

#endif

}  // namespace backlash::simulation::sundials
