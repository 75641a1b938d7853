// SPDX-License-Identifier: BSD-3-Clause
// What differs between SUNDIALS 6 and 7: how a context is made, how the library is kept from printing, and
// that since 7.1 what all of ARKODE's steppers share is named ARKode... and no longer ERKStep....
#pragma once

#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <sundials/sundials_context.h>

#if SUNDIALS_VERSION_MAJOR < 7 || (SUNDIALS_VERSION_MAJOR == 7 && SUNDIALS_VERSION_MINOR < 1)
#define ARKodeEvolve ERKStepEvolve
#define ARKodeFree ERKStepFree
#define ARKodeGetCurrentTime ERKStepGetCurrentTime
#define ARKodeGetNumErrTestFails ERKStepGetNumErrTestFails
#define ARKodeGetNumSteps ERKStepGetNumSteps
#define ARKodeGetReturnFlagName ERKStepGetReturnFlagName
#define ARKodeGetRootInfo ERKStepGetRootInfo
#define ARKodeRootInit ERKStepRootInit
#define ARKodeSetInitStep ERKStepSetInitStep
#define ARKodeSetMaxErrTestFails ERKStepSetMaxErrTestFails
#define ARKodeSetMaxHnilWarns ERKStepSetMaxHnilWarns
#define ARKodeSetMaxNumSteps ERKStepSetMaxNumSteps
#define ARKodeSetMaxStep ERKStepSetMaxStep
#define ARKodeSetNoInactiveRootWarn ERKStepSetNoInactiveRootWarn
#define ARKodeSetRootDirection ERKStepSetRootDirection
#define ARKodeSetStopTime ERKStepSetStopTime
#define ARKodeSetUserData ERKStepSetUserData
#define ARKodeWFtolerances ERKStepWFtolerances
#endif

namespace backlash::simulation::sundials {

// Errors are reported through return codes; the library's own printing would only repeat them.
#if SUNDIALS_VERSION_MAJOR >= 7

inline int create_context(SUNContext* context) {
  const int code = SUNContext_Create(SUN_COMM_NULL, context);
  return code < 0 ? code : SUNContext_ClearErrHandlers(*context);
}
inline int silence_explicit(void* memory) {
  return ARKodeSetMaxHnilWarns(memory, -1);
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
