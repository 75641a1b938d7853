// SPDX-License-Identifier: BSD-3-Clause
// SUNDIALS' serial vector with the operations of an explicit step written for a few numbers: there the
// library's own take most of the time, by loops and calls that only long vectors repay.
#pragma once

#include <nvector/nvector_serial.h>

namespace backlash::simulation {

/// A vector of `length` zeros; its clones are alike. Null where memory is short.
N_Vector new_small_vector(sunindextype length, SUNContext context);

}  // namespace backlash::simulation
