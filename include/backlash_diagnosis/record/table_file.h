// SPDX-License-Identifier: BSD-3-Clause
// Files of other programs that are tables with names of their own, read by the `channels` of a rig file:
//
//   .csv   record/csv.h
//   .json  a list of entries, one object each, alone or as a member beside what else the file says; or an
//          object of lists of one length. Numbers, true and false; NaN, Infinity and null are no number.
//          A list in an entry is read by `element`
//   .npz   NumPy's archive of arrays: one or two dimensions, whole or floating-point numbers of 1 to 8 bytes,
//          stored or deflated. A column of a two-dimensional array is read by `element`
#pragma once

#include <string>

#include "backlash_diagnosis/record/channel_map.h"
#include "backlash_diagnosis/record/record.h"

namespace backlash::record {

/// Whether the name ends as that of a file that only a channel map can read: .json, .npz.
bool is_table_file(const std::string& path);

/// Throws MissingInput where the file cannot be opened; BadData with entry or row where it cannot be read,
/// where a column is not there (with those that are), and where the map has no columns.
Record read_table(const std::string& path, const ChannelMap& map);

/// The same of a text in JSON.
Record read_json(const std::string& text, const std::string& name, const ChannelMap& map);

}  // namespace backlash::record
