// SPDX-License-Identifier: BSD-3-Clause
#include "traverse_waves.h"

#include <cmath>

namespace backlash::diagnosis {
namespace {

constexpr int kMostOrders = 48;  // per turn of the motor: poles and slots of servo motors
constexpr double kWaveSeen = 5;  // times what white noise shows, choice; what is left is not white

}  // namespace

std::vector<double> wave_orders(std::vector<double> left, const std::vector<double>& angle, int most) {
  std::vector<double> orders;
  while (int(orders.size()) < most) {
    double best = 0, order = 0, sine = 0, cosine = 0, all = 0;
    for (const double x : left) all += x * x;
    for (int n = 1; n <= kMostOrders; ++n) {
      double s = 0, c = 0;
      for (std::size_t i = 0; i < left.size(); ++i)
        s += left[i] * std::sin(n * angle[i]), c += left[i] * std::cos(n * angle[i]);
      if (s * s + c * c > best) best = s * s + c * c, order = n, sine = s, cosine = c;
    }
    // Of white noise 2 (s^2 + c^2) / all is exponential with mean 1 about each order.
    if (!(2 * best / all > kWaveSeen * std::log(double(kMostOrders)))) break;
    orders.push_back(order);
    for (std::size_t i = 0; i < left.size(); ++i)
      left[i] -=
          2 / double(left.size()) * (sine * std::sin(order * angle[i]) + cosine * std::cos(order * angle[i]));
  }
  return orders;
}

}  // namespace backlash::diagnosis
