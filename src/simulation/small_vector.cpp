// SPDX-License-Identifier: BSD-3-Clause
#include "small_vector.h"

#include <cmath>

namespace backlash::simulation {
namespace {

// Two numbers at once: what every processor of this kind has, so that no other binary is needed. Compilers
// make two of a plain loop only where its length is known.
using Pair = double __attribute__((vector_size(16), aligned(8), may_alias));

constexpr int kMostVectors = 16;
constexpr sunindextype kMostNumbers = 8;

inline double* data(N_Vector v) {
  return NV_DATA_S(v);
}

inline Pair& pair(double* numbers, int i) {
  return *reinterpret_cast<Pair*>(numbers + 2 * i);
}

/// z = sum of c[i] x[i]; z may be one of them.
template <int Pairs>
void combine(int count, const double* c, double* const* x, double* z) {
  Pair sum[Pairs];
  for (int k = 0; k < Pairs; ++k) sum[k] = c[0] * pair(x[0], k);
  for (int i = 1; i < count; ++i)
    for (int k = 0; k < Pairs; ++k) sum[k] += c[i] * pair(x[i], k);
  for (int k = 0; k < Pairs; ++k) pair(z, k) = sum[k];
}

void combine_any(sunindextype length, int count, const double* c, double* const* x, double* z) {
  for (sunindextype k = 0; k < length; ++k) {
    double sum = c[0] * x[0][k];
    for (int i = 1; i < count; ++i) sum += c[i] * x[i][k];
    z[k] = sum;
  }
}

void combine(sunindextype length, int count, const double* c, double* const* x, double* z) {
  switch (length) {
    case 2:
      return combine<1>(count, c, x, z);
    case 4:
      return combine<2>(count, c, x, z);
    case 6:
      return combine<3>(count, c, x, z);
    case 8:
      return combine<4>(count, c, x, z);
    default:
      return combine_any(length, count, c, x, z);
  }
}

int linear_combination(int count, sunrealtype* c, N_Vector* x, N_Vector z) {
  if (count < 1 || count > kMostVectors) return -1;
  double* numbers[kMostVectors];
  for (int i = 0; i < count; ++i) numbers[i] = data(x[i]);
  combine(NV_LENGTH_S(z), count, c, numbers, data(z));
  return 0;
}

void linear_sum(sunrealtype a, N_Vector x, sunrealtype b, N_Vector y, N_Vector z) {
  const double c[] = {a, b};
  double* const numbers[] = {data(x), data(y)};
  combine(NV_LENGTH_S(z), 2, c, numbers, data(z));
}

void scale(sunrealtype c, N_Vector x, N_Vector z) {
  double* const numbers[] = {data(x)};
  combine(NV_LENGTH_S(z), 1, &c, numbers, data(z));
}

sunrealtype weighted_rms(N_Vector x, N_Vector w) {
  const double *a = data(x), *b = data(w);
  const sunindextype n = NV_LENGTH_S(x);
  double sum = 0;
  for (sunindextype k = 0; k < n; ++k) sum += a[k] * b[k] * (a[k] * b[k]);
  return std::sqrt(sum / double(n));
}

}  // namespace

N_Vector new_small_vector(sunindextype length, SUNContext context) {
  N_Vector v = N_VNew_Serial(length, context);
  if (!v) return nullptr;
  N_VConst(0, v);
  if (length > kMostNumbers) {
    N_VEnableFusedOps_Serial(v, SUNTRUE);
    return v;
  }
  v->ops->nvlinearcombination = linear_combination;
  v->ops->nvlinearsum = linear_sum;
  v->ops->nvscale = scale;
  v->ops->nvwrmsnorm = weighted_rms;
  return v;
}

}  // namespace backlash::simulation
