// SPDX-License-Identifier: BSD-3-Clause
#include "backlash_diagnosis/record/table_file.h"

#include <filesystem>
#include <map>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"
#include "backlash_diagnosis/base/text.h"
#include "backlash_diagnosis/record/csv.h"
#include "mapped_rows.h"
#include "npz.h"

namespace backlash::record {
namespace {

constexpr std::size_t kMostJson = std::size_t{1} << 28;  // bytes; choice: as a tree it takes ten times that

std::string extension_of(const std::string& path) {
  return std::filesystem::path(path).extension().string();
}

/// The arrays that are read, which must have one length.
std::map<std::size_t, NpyArray> arrays_of(const NpzFile& file, const MappedRows& rows,
                                          const std::string& path) {
  std::map<std::size_t, NpyArray> arrays;
  for (const MappedColumn& column : rows.columns())
    if (arrays.count(column.place) == 0) arrays[column.place] = file.array(file.names()[column.place]);
  const auto& [first_place, first] = *arrays.begin();
  for (const MappedColumn& column : rows.columns()) {
    const NpyArray& array = arrays[column.place];
    const std::string name = path + ", array " + printable(column.name);
    if (array.rows != first.rows)
      throw BadData(name, "has " + std::to_string(array.rows) + " rows, " +
                              printable(file.names()[first_place]) + " has " + std::to_string(first.rows));
    const std::size_t element = column.source->element;
    if ((element == 0 && array.columns != 1) || element > array.columns)
      throw BadData(name, "has " + std::to_string(array.columns) + " columns: channels." + column.key +
                              " must say which as element, from 1");
  }
  return arrays;
}

Record read_npz(const std::string& path, const ChannelMap& map) {
  const NpzFile file(path);
  MappedRows rows(path, map);
  if (const MappedRows::Match match = rows.find(file.names()); !match.refusal.empty())
    throw BadData(path, match.refusal);
  const std::map<std::size_t, NpyArray> arrays = arrays_of(file, rows, path);
  Place place(path, ", row ");
  rows.resolve_units({}, place, 1, 1);
  std::vector<std::string> texts(rows.columns().size());
  for (std::size_t row = 0; row < arrays.begin()->second.rows; ++row) {
    place.go_to(row + 1);
    for (std::size_t i = 0; i < texts.size(); ++i) {
      const MappedColumn& column = rows.columns()[i];
      const std::size_t element = column.source->element;
      texts[i] = to_text(arrays.at(column.place).at(row, element > 0 ? element - 1 : 0));
    }
    rows.add(texts, place);
  }
  return rows.finish();
}

}  // namespace

bool is_table_file(const std::string& path) {
  const std::string extension = extension_of(path);
  return extension == ".json" || extension == ".npz";
}

Record read_table(const std::string& path, const ChannelMap& map) {
  if (extension_of(path) == ".csv") return read_csv(path, map, map.joint);
  if (map.columns.empty())
    throw BadData(path,
                  "has names of its own: a rig file (--rig) must say in `channels` which of them is what "
                  "(doc/reference/records.md)");
  if (extension_of(path) == ".npz") return read_npz(path, map);
  const std::string text = read_start(path, kMostJson + 1);
  if (text.size() > kMostJson)
    throw BadData(path, "has more than " + std::to_string(kMostJson) + " bytes, which are not read as JSON");
  return read_json(text, path, map);
}

}  // namespace backlash::record
