// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/numbers.h"

#include <algorithm>
#include <cmath>

namespace backlash::record {
namespace {

bool is_hardly_recorded(const std::vector<double>& x) {
  const auto numbers = std::count_if(x.begin(), x.end(), [](double value) { return std::isfinite(value); });
  return double(numbers) < kHardlyRecorded * double(x.size());
}

}  // namespace

void keep_rows(Record& record, const std::vector<bool>& rows) {
  const auto keep = [&rows](std::vector<double>& x) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
      if (rows[i]) x[kept++] = x[i];
    x.resize(kept);
  };
  keep(record.time);
  for (const Channel channel : kChannels) keep(record.column(channel));
}

void keep_rows_with_numbers(const std::vector<Record*>& records) {
  std::vector<bool> rows(records.front()->size(), true);
  std::vector<std::vector<double>*> absent;
  for (Record* record : records)
    for (const Channel channel : kChannels) {
      std::vector<double>& x = record->column(channel);
      if (x.empty()) continue;
      if (is_hardly_recorded(x)) {
        absent.push_back(&x);
        continue;
      }
      for (std::size_t i = 0; i < x.size(); ++i) rows[i] = rows[i] && std::isfinite(x[i]);
    }
  if (std::count(rows.begin(), rows.end(), true) == 0) return;
  const bool whole = std::count(rows.begin(), rows.end(), false) == 0;
  if (whole && absent.empty()) return;
  for (std::vector<double>* x : absent) x->clear();
  for (Record* record : records) keep_rows(*record, rows);
}

}  // namespace backlash::record
